// SPDX-License-Identifier: MIT
#include <pybind11/stl.h>

#include <limits>
#include <memory>
#include <optional>
#include <palpate/ring.hpp>

#include "constructors.hpp"
#include "sample_rows.hpp"

namespace {

/// What Python prints for a value, its first 60 characters; its type where it cannot be printed.
std::string quoted(py::handle value) {
  constexpr py::ssize_t longest = 60;
  try {
    const py::str text = py::repr(value);
    const auto begin = py::reinterpret_steal<py::str>(PyUnicode_Substring(text.ptr(), 0, longest));
    return std::string(begin) + (PyUnicode_GET_LENGTH(text.ptr()) > longest ? "..." : "");
  } catch (const py::error_already_set& error) {
    if (!error.matches(PyExc_Exception)) {
      throw;
    }
    return std::string("a value of type ") + Py_TYPE(value.ptr())->tp_name;
  }
}

/// Clear the error of a value that is not a number; raise others, for example an interrupt.
void clear_error() {
  if (PyErr_Occurred() && !PyErr_ExceptionMatches(PyExc_Exception)) {
    throw py::error_already_set();
  }
  PyErr_Clear();
}

/// An integer of Python or numpy in its range. A bool is refused: a source that gives one has mixed up its fields.
template <class Integer>
Integer whole(PyObject* value, const char* name, Integer least, Integer most) {
  const auto refused = [&] {
    return std::string(name) + ": got " + quoted(value) + ", allowed: an integer, " + std::to_string(least) + " to " +
           std::to_string(most);
  };
  py::object integer;
  if (PyIndex_Check(value) && !PyBool_Check(value)) {
    integer = py::reinterpret_steal<py::object>(PyNumber_Index(value));
  }
  if (!integer) {
    clear_error();
    throw py::type_error(refused());
  }
  int overflow = 0;
  const long long number = PyLong_AsLongLongAndOverflow(integer.ptr(), &overflow);
  if (overflow != 0 || number < least || number > most) {
    throw py::value_error(refused());
  }
  return static_cast<Integer>(number);
}

/// What float(value) gives, but for text and bool.
double real(PyObject* value, const char* name) {
  if (!PyBool_Check(value)) {
    const double number = PyFloat_AsDouble(value);
    if (number != -1.0 || !PyErr_Occurred()) {
      return number;
    }
    clear_error();
  }
  throw py::type_error(std::string(name) + ": got " + quoted(value) + ", allowed: a real number, pF");
}

/// A row, and how it comes from Python.
struct SampleRow : palpate::rows::Row {
  /// Every field is checked against the ranges of a recording: a row that was counted can also be stored.
  static SampleRow of(py::handle sample) {
    if (!py::isinstance<py::tuple>(sample)) {
      throw py::type_error("sample: got " + quoted(sample) + ", allowed: a palpate.Sample");
    }
    if (const auto size = PyTuple_GET_SIZE(sample.ptr()); size != 9) {
      throw py::value_error("sample: got " + std::to_string(size) + " fields, allowed: the 9 of palpate.Sample");
    }
    const auto field = [&](py::ssize_t place) { return PyTuple_GET_ITEM(sample.ptr(), place); };
    using Time = std::numeric_limits<std::int64_t>;
    return {{whole<std::int64_t>(field(0), "seq", 0, Time::max()),
             whole<std::int64_t>(field(1), "t_hard_ns", Time::min(), Time::max()),
             whole<std::int64_t>(field(2), "t_soft_ns", Time::min(), Time::max()),
             whole<std::int32_t>(field(3), "hard_raw", no_code, last_code),
             whole<std::int32_t>(field(4), "soft_raw", no_code, last_code),
             real(field(5), "hard"),
             real(field(6), "soft"),
             whole<std::uint8_t>(field(7), "status", 0, last_status),
             {},
             whole<std::int32_t>(field(8), "t_uncertainty_us", unknown, std::numeric_limits<std::int32_t>::max())}};
  }

  py::tuple fields() const {
    return py::make_tuple(seq, t_hard_ns, t_soft_ns, hard_raw, soft_raw, hard, soft, status, t_uncertainty_us);
  }

  static constexpr std::int32_t no_code = -1, last_code = std::numeric_limits<std::int32_t>::max(), unknown = -1;
};

class HeapStorage {
 public:
  using item_type = SampleRow;
  explicit HeapStorage(std::size_t capacity) : capacity_(capacity), items_(new SampleRow[capacity]()) {}
  std::size_t capacity() const noexcept { return capacity_; }
  SampleRow* items() noexcept { return items_.get(); }

 private:
  std::size_t capacity_;
  std::unique_ptr<SampleRow[]> items_;
};

using SampleRing = palpate::BasicRing<HeapStorage>;
constexpr py::ssize_t default_capacity = 1024;
constexpr std::size_t most = std::size_t{1} << 30;

std::size_t power_of_two(py::ssize_t capacity) {
  if (capacity < 2 || capacity > static_cast<py::ssize_t>(most)) {
    throw py::value_error("capacity: got " + std::to_string(capacity) + ", allowed: 2 <= capacity <= 2**30");
  }
  std::size_t power = 2;
  while (power < static_cast<std::size_t>(capacity)) {
    power *= 2;
  }
  return power;
}

class PyRing {
 public:
  explicit PyRing(py::ssize_t capacity) : ring_(std::make_unique<SampleRing>(HeapStorage(power_of_two(capacity)))) {}

  bool push(py::handle sample) {
    require_open();
    return ring_->try_push(SampleRow::of(sample));
  }
  static py::tuple row(PyRing&, py::handle sample) { return SampleRow::of(sample).fields(); }
  std::size_t push_many(py::handle samples) {
    require_open();
    const auto rows = rows_of(samples, "samples", 0);
    return ring_->push(rows.items(), static_cast<std::size_t>(rows.size));
  }
  std::size_t pop_many(py::handle out) {
    const auto rows = rows_of(out, "out", writeable);
    return ring_->pop(rows.items(), static_cast<std::size_t>(rows.size));
  }
  void close() { closed_ = true; }

  py::object dtype() const { return once<&sample_dtype>(); }
  std::size_t capacity() const { return ring_->capacity(); }
  std::size_t dropped() const { return ring_->dropped(); }
  std::optional<std::size_t> first_dropped() const {
    return dropped() == 0 ? std::nullopt : std::optional(ring_->first_dropped());
  }
  std::size_t size() const { return ring_->size(); }
  bool closed() const { return closed_; }
  std::string repr() const {
    return "<SampleRing(" + std::to_string(capacity()) + ") len=" + std::to_string(size()) +
           " dropped=" + std::to_string(dropped()) + (closed_ ? " closed>" : ">");
  }

 private:
  void require_open() const {
    if (closed_) {
      throw py::value_error("ring: got a sample after close(), allowed: none");
    }
  }

  static View<SampleRow> rows_of(py::handle value, const char* name, int flags) {
    const auto rows = sample_rows(value, name, flags);
    return {rows.data, rows.stride, rows.size};
  }

  std::unique_ptr<SampleRing> ring_;  // aligned to cache lines, which pybind11 does not do
  bool closed_ = false;
};

constexpr auto ring_doc = R"(A queue of samples from one thread to one other, of fixed capacity and without locks.

Parameters
----------
capacity : int, 2 to 2**30
    Samples that it holds, rounded up to a power of two.

Raises
------
ValueError
    A capacity out of its range.

Notes
-----
When it is full the newest samples are dropped: what is inside stays in order, and `dropped`
counts them. One thread pushes, one other pops; the counters may be read from anywhere.

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

constexpr auto push_many_doc = R"(push_many($self, samples, /)
--

Push an array of `dtype`, shape (n,), contiguous; return how many were accepted: the first ones. ValueError after `close`.)";

constexpr auto pop_many_doc = R"(pop_many($self, out, /)
--

Pop into an array of `dtype`, shape (n,), contiguous, the oldest first; return how many there were.)";

constexpr auto push_doc = R"(push($self, sample, /)
--

Push one `Sample`; return whether there was room. Its integers and real numbers may be numpy's.

TypeError or ValueError for a field that is not a number (a bool is not), or outside its range: `seq` from 0 and times of
64 bits, codes of 31 bits or -1, status 0 to 8, an uncertainty of 31 bits or -1. ValueError after `close`.)";

constexpr auto row_doc = R"(row($self, sample, /)
--

Return the fields of a `Sample` as the ring stores them, as int and float; errors as of `push`. Pushes nothing.)";

PyRing made(const methods::Given& given) {
  methods::refuse_others(given, "capacity");
  return PyRing(!given.first ? default_capacity : methods::to_size("capacity", given.first));
}

void refuse_pickle(py::handle, py::handle) {
  throw py::type_error("cannot pickle a SampleRing: it is between threads");
}

}  // namespace

void bind_ring(py::module_& module) {
  const std::string parameters = "(capacity=" + std::to_string(default_capacity) + ")";
  auto type = methods::define_class<&made>(module, "SampleRing", parameters, ring_doc);
  methods::define<&PyRing::push>(type, push_doc);
  methods::define<&PyRing::row>(type, row_doc);
  methods::define<&PyRing::push_many>(type, push_many_doc);
  methods::define<&PyRing::pop_many>(type, pop_many_doc);
  methods::define<&PyRing::close>(type,
                                  "close($self)\n--\n\nAccept no more samples; what is inside can still be popped.");
  methods::define<&PyRing::size>(type, "__len__($self, /)\n--\n\n");
  methods::define<&PyRing::repr>(type, "__repr__($self, /)\n--\n\n");
  methods::define<&refuse_pickle>(type, "__reduce_ex__($self, protocol, /)\n--\n\n");
  methods::property<&PyRing::dtype>(type, "dtype",
                                    "numpy.dtype of a sample: the fields of `Sample`, 56 bytes with the padding.");
  methods::property<&PyRing::capacity>(type, "capacity", "Samples that it holds.");
  methods::property<&PyRing::dropped>(type, "dropped", "Samples dropped so far because it was full.");
  methods::property<&PyRing::first_dropped>(
      type, "first_dropped", "How many had been accepted when the first was dropped; None where none was.");
  methods::property<&PyRing::closed>(type, "closed", "Whether `close` was called.");
}
