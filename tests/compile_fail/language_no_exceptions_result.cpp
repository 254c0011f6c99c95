// expect: lrt needs exceptions
// flags: -fno-exceptions
#include <lrt/base/result.hpp>

int main() {}
