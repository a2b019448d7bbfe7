// SPDX-License-Identifier: MIT
#include "touch.hpp"

#include <pybind11/gil_safe_call_once.h>

namespace {

py::tuple flags_of(const palpate::runs::Result& touch, const py::object& flag) {
  py::list flags;
  touch.visit_flags([&](const char* name) { flags.append(flag(name)); });
  return py::tuple(flags);
}

py::dict effects_of(const palpate::runs::Result& touch) {
  py::dict effects;
  if (touch.knows_error) {
    effects["offset"] = touch.fitted.offset;
    effects["drift"] = touch.fitted.drift;
    effects["lag"] = touch.lag_ms();
    effects["curve"] = touch.fitted.curve;
    effects["tilt"] = touch.fitted.tilt;
    effects["shift"] = touch.shift;
  }
  return effects;
}

}  // namespace

TouchType::TouchType()
    : touch_(py::module_::import("palpate.touch").attr("Touch")),
      flag_(py::module_::import("palpate.flags").attr("Flag")) {}

py::object TouchType::of(const palpate::runs::Result& r) const {
  return touch_(r.start, r.start_s, r.samples, r.ratio, r.covariance, r.standard_error, r.revised(), r.first_ratio,
                r.first_standard_error, r.level.ratio, r.level.standard_error, r.contact_exponent, r.age,
                r.before.ratio, r.before.standard_error, r.after.ratio, r.after.standard_error, r.fitted.offset_ratio,
                r.fitted.offset_error, effects_of(r), r.alarm_share(), r.saturated, r.refused, flags_of(r, flag_),
                r.held);
}

const TouchType& touch_type() {
  static py::gil_safe_call_once_and_store<TouchType> storage;
  return storage.call_once_and_store_result([] { return TouchType(); }).get_stored();
}
