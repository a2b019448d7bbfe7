// SPDX-License-Identifier: MIT
#include "bank.hpp"
#include "estimator_settings.hpp"
#include "fastcall.hpp"
#include "pickling.hpp"

namespace {

constexpr auto class_doc = R"(Many streams at once, each with an estimator of its own and all with the same settings.

Parameters
----------
streams : int, 1 or more
    How many.
**settings
    Those of the single estimator; a name that it does not have is a TypeError.

Raises
------
TypeError, ValueError
    As the single estimator.

Notes
-----
Bit for bit what as many single estimators give. The loops of RlsBank and AdaptiveRlsBank fill SIMD
registers; HandoverRlsBank, whose steps differ from stream to stream, only saves calls: use
`process`.

Examples
--------
>>> import palpate
>>> bank = palpate.AdaptiveRlsBank(3, drift=0.005)
>>> bank.update([0.5, 0.6, 0.7], [0.25, 0.25, 0.25]).round(2)
array([2. , 2.4, 2.8])
)";

constexpr auto update_doc = R"(update($self, output, regressor, out=None)
--

Take one sample of each stream and return their ratios.

Parameters
----------
output, regressor : array_like of real numbers, shape (streams,), pF
out : numpy.ndarray, shape (streams,), optional
    Where the ratios are written; it may be `output` or `regressor` itself.

Returns
-------
numpy.ndarray, shape (streams,)
    The ratios. A sample that is not finite is refused, and counted in `rejected`.

Raises
------
TypeError, ValueError
    Values that are not real numbers; another shape; an `out` of another type.
RuntimeError
    The bank is in use by another thread.
)";

constexpr auto process_doc = R"(process($self, output, regressor, out=None)
--

Take a block of samples of each stream; the same bits as one `update` for each row.

Parameters
----------
output, regressor : array_like of real numbers, shape (n, streams), pF
    Read in place where they are contiguous and of the bank's own type.
out : numpy.ndarray, shape (n, streams), contiguous, optional
    Where the ratios are written; it may be `output` or `regressor` itself.

Returns
-------
numpy.ndarray, shape (n, streams)
    The ratios after each row.

Raises
------
TypeError, ValueError, RuntimeError
    As `update`.
)";

template <class Settings>
Settings settings_of(const py::kwargs& given) {
  py::dict values = to_dict(Settings{});
  for (const auto& [name, value] : given) {
    if (!values.contains(name)) {
      throw py::type_error(py::str(name).cast<std::string>() +
                           ": no such setting, allowed: " + py::str(", ").attr("join")(values).cast<std::string>());
    }
    values[name] = value;
  }
  try {
    const auto settings = from_dict<Settings>(values);
    settings.check();
    return settings;
  } catch (const py::cast_error&) {
    throw py::type_error("settings: got " + py::repr(given).cast<std::string>() + ", allowed: numbers");
  }
}

template <class B, int Dimensions>
PyObject* taken(B& bank, py::handle output, py::handle regressor, py::handle out) {
  return bank.take(output, regressor, out, Dimensions).release().ptr();
}

template <class Settings, class States>
void bind(py::module_& module, const char* name) {
  using B = PyBank<Settings, States>;
  using Real = typename B::Real;
  py::class_<B> type(module, name, class_doc);
  type.attr("__module__") = "palpate";
  fastcall::def_block<B, &taken<B, 1>>(type, "update", update_doc);
  fastcall::def_block<B, &taken<B, 2>>(type, "process", process_doc);
  bind_pickling(type);
  if constexpr (std::is_same_v<States, CoreStates<Settings>>) {
    type.def_property_readonly(
        "standard_error",
        [](const B& b) {
          return b.template each<Real>([](const States& s, std::size_t i) { return s.standard_error(i); });
        },
        "Standard deviation of each stream's ratio; nan where it is not known.");
  }
  type.def(py::init(
               [](py::ssize_t streams, const py::kwargs& given) { return B(settings_of<Settings>(given), streams); }),
           py::arg("streams"))
      .def("reset", &B::reset, "Forget every sample: as newly made with the same settings.")
      .def("__len__", [](const B& b) { return b.streams(); })
      .def("__repr__",
           [name](const B& b) {
             return "<" + std::string(name) + "(" + std::to_string(b.streams()) + ") rows=" + std::to_string(b.rows()) +
                    ">";
           })
      .def_property_readonly(
          "settings", [](const B& b) { return to_dict(b.settings()); }, "The parameters, as a dict.")
      .def_property_readonly("streams", &B::streams, "How many.")
      .def_property_readonly("rows", &B::rows, "Samples offered to each stream so far.")
      .def_property_readonly(
          "samples",
          [](const B& b) {
            return b.template each<std::uint64_t>(
                [&](const States& s, std::size_t i) { return b.rows() - s.rejected(i); });
          },
          "Samples of each stream accepted so far.")
      .def_property_readonly(
          "ratio",
          [](const B& b) { return b.template each<Real>([](const States& s, std::size_t i) { return s.ratio(i); }); },
          "Estimated output / regressor of each stream.")
      .def_property_readonly(
          "covariance",
          [](const B& b) {
            return b.template each<Real>([](const States& s, std::size_t i) { return s.covariance(i); });
          },
          "Unscaled covariance of each stream, 1/pF^2.")
      .def_property_readonly(
          "statistic",
          [](const B& b) {
            return b.template each<Real>([](const States& s, std::size_t i) { return s.statistic(i); });
          },
          "CUSUM statistic of each stream; 0 where there is no detector.")
      .def_property_readonly(
          "alarm",
          [](const B& b) { return b.template each<bool>([](const States& s, std::size_t i) { return s.alarm(i); }); },
          "Whether the alarm of each stream is on.")
      .def_property_readonly(
          "rejected",
          [](const B& b) {
            return b.template each<std::uint64_t>([](const States& s, std::size_t i) { return s.rejected(i); });
          },
          "Samples of each stream refused so far.");
}

template <template <class> class Settings, template <class> class States>
void bind_both(py::module_& module, const char* name, const char* name32) {
  bind<Settings<double>, States<Settings<double>>>(module, name);
  bind<Settings<float>, States<Settings<float>>>(module, name32);
}

}  // namespace

void bind_bank(py::module_& module) {
  bind_both<RlsSettings, LaneStates>(module, "RlsBank", "RlsBank32");
  bind_both<AdaptiveSettings, LaneStates>(module, "AdaptiveRlsBank", "AdaptiveRlsBank32");
  bind_both<HandoverSettings, CoreStates>(module, "HandoverRlsBank", "HandoverRlsBank32");
  module.attr("simd") = bank_loops().name;
}
