#include <lrt/httplib.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/httplib_host.hpp"
