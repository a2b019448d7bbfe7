// SPDX-License-Identifier: MIT
#include <limits>
#include <memory>
#include <palpate/ring.hpp>
#include <vector>

#include "sample_rows.hpp"

namespace {

/// An integer of Python or numpy in its range. A bool is refused: a source that gives one has mixed up its fields.
template <class Integer>
Integer whole(py::handle value, const char* name, Integer least, Integer most = std::numeric_limits<Integer>::max()) {
  const auto allowed = [=] { return "an integer, " + std::to_string(least) + " to " + std::to_string(most); };
  if (!PyIndex_Check(value.ptr()) || PyBool_Check(value.ptr())) {
    refuse<type_error>(name, shown(value), allowed());
  }
  int overflow = 0;
  const long long number = PyLong_AsLongLongAndOverflow(value.ptr(), &overflow);
  if (number == -1 && PyErr_Occurred()) {
    throw py::error_already_set();
  }
  if (overflow != 0 || number < least || number > most) {
    refuse<value_error>(name, shown(value), allowed());
  }
  return static_cast<Integer>(number);
}

/// What float(value) gives, but for bool.
double real(py::handle value, const char* name) {
  constexpr auto allowed = "a real number, pF";
  if (PyBool_Check(value.ptr())) {
    refuse<type_error>(name, shown(value), allowed);
  }
  return to_real(value, name, allowed);
}

/// Every field is checked against the ranges of a recording: a row that was counted can also be stored.
Row row_of(py::handle sample) {
  if (!py::isinstance<py::tuple>(sample)) {
    refuse<type_error>("sample", shown(sample), "a palpate.Sample");
  }
  if (const auto size = PyTuple_GET_SIZE(sample.ptr()); size != 9) {
    refuse<value_error>("sample", std::to_string(size) + " fields", "the 9 of palpate.Sample");
  }
  const auto field = [&](py::ssize_t place) { return py::handle(PyTuple_GET_ITEM(sample.ptr(), place)); };
  constexpr std::int32_t unknown = -1;
  constexpr auto earliest = std::numeric_limits<std::int64_t>::min();
  return {whole<std::int64_t>(field(0), "seq", 0),
          whole<std::int64_t>(field(1), "t_hard_ns", earliest),
          whole<std::int64_t>(field(2), "t_soft_ns", earliest),
          whole<std::int32_t>(field(3), "hard_raw", unknown),
          whole<std::int32_t>(field(4), "soft_raw", unknown),
          real(field(5), "hard"),
          real(field(6), "soft"),
          whole<std::uint8_t>(field(7), "status", 0, Row::last_status),
          {},
          whole<std::int32_t>(field(8), "t_uncertainty_us", unknown)};
}

class HeapStorage {
 public:
  using item_type = Row;
  explicit HeapStorage(std::size_t capacity) : items_(capacity) {}
  std::size_t capacity() const noexcept { return items_.size(); }
  Row* items() noexcept { return items_.data(); }

 private:
  std::vector<Row> items_;
};

HeapStorage storage_of(py::ssize_t capacity) {
  if (capacity < 2 || capacity > py::ssize_t{1} << 30) {
    refuse<value_error>("capacity", capacity, "2 <= capacity <= 2**30");
  }
  std::size_t power = 2;
  while (power < static_cast<std::size_t>(capacity)) {
    power *= 2;
  }
  return HeapStorage(power);
}

struct PyRing : palpate::BasicRing<HeapStorage> {
  explicit PyRing(py::ssize_t capacity) : BasicRing(storage_of(capacity)) {}

  void require_open() const {
    if (closed) {
      refuse<value_error>("ring", "a sample after close()", "none");
    }
  }
  bool push_sample(py::handle sample) {
    require_open();
    return try_push(row_of(sample));
  }
  static py::tuple row(const PyRing&, py::handle sample) {
    const auto r = row_of(sample);
    return py::make_tuple(r.seq, r.t_hard_ns, r.t_soft_ns, r.hard_raw, r.soft_raw, r.hard, r.soft, r.status,
                          r.t_uncertainty_us);
  }
  std::size_t push_many(py::handle samples) {
    require_open();
    const auto rows = sample_rows(samples, "samples");
    return push(rows.items(), static_cast<std::size_t>(rows.size));
  }
  std::size_t pop_many(py::handle out) {
    const auto rows = sample_rows(out, "out", writeable);
    return pop(rows.items(), static_cast<std::size_t>(rows.size));
  }
  void close() { closed = true; }

  static py::object dtype(const PyRing&) { return once<&sample_dtype>(); }
  py::object first() const { return dropped() == 0 ? py::none() : py::cast(first_dropped()); }
  std::string repr() const {
    return "<SampleRing(" + std::to_string(capacity()) + ") len=" + std::to_string(size()) +
           " dropped=" + std::to_string(dropped()) + (closed ? " closed>" : ">");
  }

  bool closed = false;
};

constexpr auto ring_doc = R"(A queue of samples from one thread to one other, of fixed capacity and without locks.

When it is full the newest samples are dropped: what is inside stays in order, and `dropped` counts them. One thread
pushes, one other pops; the counters may be read from anywhere.

Parameters
----------
capacity : int, 2 to 2**30
    Samples that it holds, rounded up to a power of two.

Examples
--------
>>> import numpy as np, palpate
>>> ring = palpate.SampleRing(4)
>>> samples = np.zeros(6, ring.dtype)
>>> samples["seq"] = range(6)
>>> ring.push_many(samples), ring.dropped, ring.first_dropped
(4, 2, 4)
>>> out = np.empty(8, ring.dtype)
>>> out[: ring.pop_many(out)]["seq"]
array([0, 1, 2, 3])
)";

}  // namespace

void bind_ring(py::module_& module) {
  const auto made = [](py::handle capacity) { return std::make_unique<PyRing>(to_size(capacity, "capacity")); };
  auto type = define_class<PyRing>(module, "SampleRing", "(capacity=1024)", ring_doc, made, py::arg("capacity") = 1024);
  type.def("push", &PyRing::push_sample, R"(push(self, sample, /)
--

Push one `Sample`; return whether there was room. Its integers and real numbers may be numpy's.

TypeError or ValueError for a field that is not a number (a bool is not), or outside its range: `seq` from 0 and times of
64 bits, codes of 31 bits or -1, status 0 to 8, an uncertainty of 31 bits or -1. ValueError after `close`.)")
      .def("row", &PyRing::row,
           "row(self, sample, /)\n--\n\nReturn the fields of a `Sample` as the ring stores them, as int and float; "
           "errors as of `push`. Pushes nothing.")
      .def("push_many", &PyRing::push_many, R"(push_many(self, samples, /)
--

Push an array of `dtype`, shape (n,), contiguous; return how many were accepted: the first ones. ValueError after `close`.)")
      .def("pop_many", &PyRing::pop_many,
           "pop_many(self, out, /)\n--\n\nPop into an array of `dtype`, shape (n,), contiguous, the oldest first; "
           "return how many there were.")
      .def("close", &PyRing::close, "close(self, /)\n--\n\nAccept no more samples; what is inside can still be popped.")
      .def("__len__", &PyRing::size, "__len__(self, /)\n--\n\n")
      .def("__repr__", &PyRing::repr, "__repr__(self, /)\n--\n\n");
  type.property("dtype", &PyRing::dtype, "numpy.dtype of a sample: the fields of `Sample`, 56 bytes with the padding.")
      .property("capacity", &PyRing::capacity, "Samples that it holds.")
      .property("dropped", &PyRing::dropped, "Samples dropped so far because it was full.")
      .property("first_dropped", &PyRing::first,
                "How many had been accepted when the first was dropped; None where none was.")
      .property("closed", &PyRing::closed, "Whether `close` was called.");
}
