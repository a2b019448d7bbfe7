// SPDX-License-Identifier: MIT
#include <memory>
#include <palpate/ring.hpp>

#include "block.hpp"
#include "fastcall.hpp"
#include "fields.hpp"
#include "made.hpp"

namespace {

/// palpate.Sample as the ring carries it. The padding is a member, so that equal samples have equal bytes.
struct SampleRow {
  std::int64_t seq, t_hard_ns, t_soft_ns;
  std::int32_t hard_raw, soft_raw;
  double hard, soft;
  std::uint8_t status;
  unsigned char padding[7];

  static py::dtype dtype() {
    FieldList fields;
    fields.add<std::int64_t>("seq", offsetof(SampleRow, seq));
    fields.add<std::int64_t>("t_hard_ns", offsetof(SampleRow, t_hard_ns));
    fields.add<std::int64_t>("t_soft_ns", offsetof(SampleRow, t_soft_ns));
    fields.add<std::int32_t>("hard_raw", offsetof(SampleRow, hard_raw));
    fields.add<std::int32_t>("soft_raw", offsetof(SampleRow, soft_raw));
    fields.add<double>("hard", offsetof(SampleRow, hard));
    fields.add<double>("soft", offsetof(SampleRow, soft));
    fields.add<std::uint8_t>("status", offsetof(SampleRow, status));
    return fields.dtype(sizeof(SampleRow));
  }

  static SampleRow of(const py::tuple& sample) {
    if (sample.size() != 8) {
      throw py::value_error("sample: got " + std::to_string(sample.size()) +
                            " fields, allowed: the 8 of palpate.Sample");
    }
    try {
      return {sample[0].cast<std::int64_t>(), sample[1].cast<std::int64_t>(), sample[2].cast<std::int64_t>(),
              sample[3].cast<std::int32_t>(), sample[4].cast<std::int32_t>(), sample[5].cast<double>(),
              sample[6].cast<double>(),       sample[7].cast<std::uint8_t>(), {}};
    } catch (const py::cast_error&) {
      throw py::type_error("sample: got " + py::repr(sample).cast<std::string>() +
                           ", allowed: the fields of palpate.Sample, codes of 24 bits");
    }
  }
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

class PyRing : Made {
 public:
  using Made::operator new;
  using Made::operator delete;

  explicit PyRing(py::ssize_t capacity) : ring_(std::make_unique<SampleRing>(HeapStorage(power_of_two(capacity)))) {}

  bool push(const py::tuple& sample) {
    require_open();
    return ring_->try_push(SampleRow::of(sample));
  }

  std::size_t push_many(py::handle samples) {
    require_open();
    const auto rows = rows_of(samples, "samples", 0);
    return ring_->push(rows.items(), static_cast<std::size_t>(rows.size));
  }

  std::size_t pop_many(py::handle out) {
    require_made();
    const auto rows = rows_of(out, "out", writeable);
    return ring_->pop(rows.items(), static_cast<std::size_t>(rows.size));
  }

  py::object first_dropped() const {
    return ring().dropped() == 0 ? py::object(py::none()) : py::object(py::int_(ring().first_dropped()));
  }

  const SampleRing& ring() const {
    require_made();
    return *ring_;
  }
  void close() {
    require_made();
    closed_ = true;
  }
  bool closed() const {
    require_made();
    return closed_;
  }

 private:
  void require_open() const {
    require_made();
    if (closed_) {
      throw py::value_error("ring: got a sample after close(), allowed: none");
    }
  }

  static View<SampleRow> rows_of(py::handle value, const char* name, int flags) {
    const py::dtype& dtype = once<&SampleRow::dtype>();
    if (const auto rows = dense_view<SampleRow>(value, dtype, flags); rows.size >= 0) {
      return rows;
    }
    if (!py::isinstance<py::array>(value) ||
        !py::array(py::reinterpret_borrow<py::array>(value)).dtype().equal(dtype)) {
      const py::object got = py::getattr(value, "dtype", py::type::of(value));
      throw py::type_error(std::string(name) + ": got " + py::str(got).cast<std::string>() +
                           ", allowed: a numpy array of SampleRing.dtype");
    }
    const auto array = py::reinterpret_borrow<py::array>(value);
    require_shape(array, name, -1);
    const int needed = flags | aligned | py::array::c_style;
    if ((array.flags() & needed) != needed) {
      throw py::value_error(std::string(name) +
                            ": got a strided, unaligned or read-only array, allowed: a contiguous one" +
                            (flags ? " that may be written" : ""));
    }
    return View<SampleRow>::of(array);
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

PyObject* pushed_many(PyRing& ring, py::handle samples) { return PyLong_FromSize_t(ring.push_many(samples)); }
PyObject* popped_many(PyRing& ring, py::handle out) { return PyLong_FromSize_t(ring.pop_many(out)); }

}  // namespace

void bind_ring(py::module_& module) {
  py::class_<PyRing> type(module, "SampleRing", ring_doc);
  type.attr("__module__") = "palpate";
  fastcall::def_single<PyRing, &pushed_many>(type, "push_many", push_many_doc);
  fastcall::def_single<PyRing, &popped_many>(type, "pop_many", pop_many_doc);
  type.def(py::init<py::ssize_t>(), py::arg("capacity") = 1024)
      .def("push", &PyRing::push, py::arg("sample"), py::pos_only(),
           "Push one `Sample`; return whether there was room. ValueError after `close`.")
      .def(
          "__reduce_ex__",
          [](const PyRing&, int) -> py::object {
            throw py::type_error("cannot pickle a SampleRing: it is between threads");
          },
          py::arg("protocol"), py::pos_only())
      .def("close", &PyRing::close, "Accept no more samples; what is inside can still be popped.")
      .def("__len__", [](const PyRing& self) { return self.ring().size(); })
      .def("__repr__",
           [](const PyRing& self) {
             return "<SampleRing(" + std::to_string(self.ring().capacity()) +
                    ") len=" + std::to_string(self.ring().size()) +
                    " dropped=" + std::to_string(self.ring().dropped()) + (self.closed() ? " closed>" : ">");
           })
      .def_property_readonly(
          "dtype", [](const PyRing&) { return once<&SampleRow::dtype>(); },
          "numpy.dtype of a sample: the fields of `Sample`, 56 bytes with the padding.")
      .def_property_readonly(
          "capacity", [](const PyRing& self) { return self.ring().capacity(); }, "Samples that it holds.")
      .def_property_readonly(
          "dropped", [](const PyRing& self) { return self.ring().dropped(); },
          "Samples dropped so far because it was full.")
      .def_property_readonly("first_dropped", &PyRing::first_dropped,
                             "How many had been accepted when the first was dropped; None where none was.")
      .def_property_readonly("closed", &PyRing::closed, "Whether `close` was called.");
}
