// SPDX-License-Identifier: MIT
#pragma once

// For Arduino and PlatformIO, which look for a header with the name of the library.

#if __cplusplus < 201703L
#error "palpate needs C++17: this board's core compiles for an older one; add -std=gnu++17 as README.md of the library says. The compiler for AVR boards, as the Uno, has no C++17."
#endif

#include <palpate/palpate.hpp>
