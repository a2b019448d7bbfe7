// SPDX-License-Identifier: MIT
#pragma once

// The result of a touch as palpate.touch.Touch, a dataclass of Python: its fields are in the order of its constructor.

#include "../runs/run.hpp"
#include "module.hpp"

class TouchType {
 public:
  TouchType();  // imports the classes
  py::object of(const palpate::runs::Result& result) const;

 private:
  py::object touch_, flag_;
};

const TouchType& touch_type();
