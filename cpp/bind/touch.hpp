// SPDX-License-Identifier: MIT
#pragma once

#include "../runs/run.hpp"
#include "module.hpp"

/// palpate.touch.Touch, a dataclass; imported by the first call.
py::object touch_class();
/// The result of a touch as an object of this class: each field by its name.
py::object touch_object(const palpate::runs::Result& touch);

using Judgement = palpate::Judgement<double, palpate::Nanoseconds>;
/// A judgement as an object of palpate.judgements.Judgement.
py::object judgement_object(const Judgement& judgement);
