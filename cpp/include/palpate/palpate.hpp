// SPDX-License-Identifier: MIT
#pragma once

// Everything: #include <palpate/palpate.hpp>.

#include <palpate/touch.hpp>
#include <palpate/version.hpp>
