// expect: lrt needs exceptions
// flags: -fno-exceptions
#include <lrt/lrt.hpp>

int main() {}
