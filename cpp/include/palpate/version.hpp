// SPDX-License-Identifier: MIT
#pragma once

// The only place of the version: pyproject.toml, CMakeLists.txt and the extension read it from here.
#define PALPATE_VERSION "0.1.0"
