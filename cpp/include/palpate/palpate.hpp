// SPDX-License-Identifier: MIT
#pragma once

// Everything: #include <palpate/palpate.hpp>.

#include <palpate/rls.hpp>
#include <palpate/version.hpp>
