// SPDX-License-Identifier: MIT
#pragma once

// The only place of the version: pyproject.toml, CMakeLists.txt and the extension read it from here.
#define PALPATE_VERSION "0.1.0"
// The inline namespace of all names: parts of a program with different versions of the headers stay apart.
#define PALPATE_NAMESPACE v0_1_0
