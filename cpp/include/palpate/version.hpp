// SPDX-License-Identifier: MIT
#pragma once

// The only place where the version is written: pyproject.toml, CMakeLists.txt and the extension read it from here.
#define PALPATE_VERSION "0.1.0"
