// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstring>
#include <new>

#include "bind.hpp"

/// pybind11 allocates an object whose __init__ was not called when one of its methods is: as zeros, it says so.
class Made {
 public:
  static void* operator new(std::size_t size) { return std::memset(::operator new(size), 0, size); }
  static void* operator new(std::size_t, void* place) { return place; }
  static void operator delete(void* memory) { ::operator delete(memory); }

 protected:
  void require_made() const {
    if (!made_) {
      throw py::type_error("__init__ of this object has not been called");
    }
  }

 private:
  bool made_ = true;
};
