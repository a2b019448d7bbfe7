// SPDX-License-Identifier: MIT
#include "bank.hpp"
#include "constructors.hpp"
#include "estimator_kinds.hpp"
#include "pickling.hpp"

namespace {

constexpr auto class_doc = R"(Estimators for many streams at once, all with the same settings.

Parameters
----------
streams : int, 1 or more
    Number of streams.
**settings
    As for the single estimator.

Raises
------
TypeError, ValueError
    As the single estimator.

Notes
-----
The same bits as single estimators, one a stream: several streams at a time in SIMD registers.

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

template <class Kind, template <class> class States>
PyBank<Kind, States> made(const methods::Given& given) {
  if (!given.first) {
    throw py::type_error(std::string(given.owner) + ": got no streams, allowed: how many estimators there are");
  }
  const Settings settings = Kind::defaults().with(given.owner, given.settings);
  Kind::check(settings);
  return PyBank<Kind, States>(settings, methods::to_size("streams", given.first));
}

template <class B>
std::string repr(py::handle self) {
  const B& bank = methods::reference<B>(self);
  return "<" + py::type::of(self).attr("__name__").template cast<std::string>() + "(" + std::to_string(bank.streams()) +
         ") rows=" + std::to_string(bank.rows()) + ">";
}

template <class Kind, template <class> class States>
void bind(py::module_& module, const char* name) {
  using B = PyBank<Kind, States>;
  const std::string parameters = "(streams, *, " + Kind::defaults().text() + ")";
  auto type = methods::define_class<&made<Kind, States>>(module, name, parameters, class_doc);
  methods::define<&B::template take<1>>(type, update_doc);
  methods::define<&B::template take<2>>(type, process_doc);
  methods::define<&B::reset>(type, "reset($self)\n--\n\nForget every sample: as newly made with the same settings.");
  methods::define<&B::streams>(type, "__len__($self, /)\n--\n\n");
  methods::define<&repr<B>>(type, "__repr__($self, /)\n--\n\n");
  define_copies(type);
  methods::property<&B::settings_dict>(type, "settings", "The parameters, as a dict.");
  methods::property<&B::streams>(type, "streams", "How many.");
  methods::property<&B::rows>(type, "rows", "Samples offered to each stream so far.");
  methods::property<&B::samples>(type, "samples", "Samples of each stream accepted so far.");
  methods::property<&B::ratio>(type, "ratio", "Estimated output / regressor of each stream.");
  methods::property<&B::covariance>(type, "covariance", "Unscaled covariance of each stream, 1/pF^2.");
  methods::property<&B::statistic>(type, "statistic", "CUSUM statistic of each stream; 0 where there is no detector.");
  methods::property<&B::alarm>(type, "alarm", "Whether the alarm of each stream is on.");
  methods::property<&B::rejected>(type, "rejected", "Samples of each stream refused so far.");
  if constexpr (knows_its_error<typename Kind::Core>) {
    methods::property<&B::standard_error>(type, "standard_error",
                                          "Standard deviation of each stream's ratio; nan where it is not known.");
  }
}

}  // namespace

void bind_banks(py::module_& module) {
  bind<FixedKind<double>, LaneStates>(module, "RlsBank");
  bind<FixedKind<float>, LaneStates>(module, "RlsBank32");
  bind<AdaptiveKind<double>, LaneStates>(module, "AdaptiveRlsBank");
  bind<AdaptiveKind<float>, LaneStates>(module, "AdaptiveRlsBank32");
  bind<HandoverKind<double>, GroupStates>(module, "HandoverRlsBank");
  bind<HandoverKind<float>, GroupStates>(module, "HandoverRlsBank32");
  module.def(
      "simd", [] { return instruction_set().name; },
      "Return the instructions of the banks; raises ValueError if the environment variable PALPATE_SIMD is wrong.");
}
