// SPDX-License-Identifier: MIT
#include "touch.hpp"

using namespace py::literals;

namespace {

using palpate::runs::Result;

py::tuple flags_of(const Result& touch) {
  const py::object flag = py::module_::import("palpate.flags").attr("Flag");
  py::list flags;
  touch.visit_flags([&](const char* name) { flags.append(flag(name)); });
  return py::tuple(flags);
}

py::dict effects_of(const Result& touch) {
  const auto& misfits = touch.misfits;
  return touch.knows_error ? py::dict("offset"_a = misfits.offset, "drift"_a = misfits.drift, "lag"_a = touch.lag_ms(),
                                      "curve"_a = misfits.curve, "tilt"_a = misfits.tilt, "shift"_a = touch.shift)
                           : py::dict();
}

}  // namespace

py::object judgement_object(const Judgement& judgement) {
  constexpr const char* names[] = {"saturated", "frozen", "jumped", "was_touch", "step", "falling", "still"};
  constexpr const char* channels[] = {"hard", "soft", "both"};
  static_assert(static_cast<std::size_t>(palpate::Judged::still) + 1 == std::size(names));
  return py::module_::import("palpate.judgements")
      .attr("Judgement")("time_s"_a = static_cast<double>(judgement.time.count) * 1e-9,
                         "channel"_a = channels[static_cast<int>(judgement.channel)],
                         "name"_a = names[static_cast<int>(judgement.what)], "size"_a = judgement.size,
                         "soft_size"_a = judgement.soft_size);
}

py::object touch_class() { return py::module_::import("palpate.touch").attr("Touch"); }

py::object touch_object(const Result& r) {
  return touch_class()("start"_a = r.start, "start_s"_a = r.start_s, "samples"_a = r.samples, "ratio"_a = r.ratio,
                       "covariance"_a = r.covariance, "standard_error"_a = r.standard_error, "revised"_a = r.revised(),
                       "first_ratio"_a = r.first_ratio, "first_standard_error"_a = r.first_standard_error,
                       "level_ratio"_a = r.level.ratio, "level_standard_error"_a = r.level.standard_error,
                       "contact_exponent"_a = r.contact_exponent, "depth_pF"_a = r.depth, "rise_s"_a = r.rise,
                       "age_s"_a = r.age, "ratio_before"_a = r.before.ratio,
                       "before_standard_error"_a = r.before.standard_error, "ratio_after"_a = r.after.ratio,
                       "after_standard_error"_a = r.after.standard_error, "offset_ratio"_a = r.misfits.offset_ratio,
                       "offset_standard_error"_a = r.misfits.offset_error, "effects"_a = effects_of(r),
                       "alarm_share"_a = r.alarm_share(), "saturated"_a = r.saturated, "refused"_a = r.refused,
                       "outliers"_a = r.outliers, "flags"_a = flags_of(r), "held"_a = r.held);
}
