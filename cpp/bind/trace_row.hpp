// SPDX-License-Identifier: MIT
#pragma once

// One row of trace(). The padding is a member, so that equal traces have equal bytes.

#include <cstddef>
#include <limits>

#include "arrays.hpp"

struct FieldList {
  py::list names, formats, offsets;

  template <class Real>
  void add(const char* name, std::size_t offset) {
    names.append(name);
    formats.append(py::dtype::of<Real>());
    offsets.append(offset);
  }
  py::dtype dtype(std::size_t size) const { return py::dtype(names, formats, offsets, static_cast<py::ssize_t>(size)); }
};

/// The fields that every row has.
template <class Row, class Real>
FieldList common_fields() {
  FieldList fields;
  fields.add<Real>("ratio", offsetof(Row, ratio));
  fields.add<Real>("covariance", offsetof(Row, covariance));
  fields.add<Real>("innovation", offsetof(Row, innovation));
  fields.add<Real>("statistic", offsetof(Row, statistic));
  return fields;
}

template <class Real>
struct TraceRow {
  Real ratio, covariance, innovation, statistic;
  bool alarm;
  unsigned char padding[sizeof(Real) - 1];

  template <class Core>
  static TraceRow of(const Core& core, const palpate::Step<Real>& step) {
    const Real innovation = step.accepted ? step.innovation : std::numeric_limits<Real>::quiet_NaN();
    return {core.ratio(), core.covariance(), innovation, core.statistic(), core.alarm(), {}};
  }

  static py::dtype dtype() {
    FieldList fields = common_fields<TraceRow, Real>();
    fields.add<bool>("alarm", offsetof(TraceRow, alarm));
    return fields.dtype(sizeof(TraceRow));
  }
};

/// The same with the standard error; NaN where it means nothing yet.
template <class Real>
struct HandoverRow {
  Real ratio, covariance, innovation, statistic, standard_error;
  bool alarm;
  unsigned char padding[sizeof(Real) - 1];

  template <class Core>
  static HandoverRow of(const Core& core, const palpate::Step<Real>& step) {
    const auto row = TraceRow<Real>::of(core, step);
    const Real error = core.settled() ? core.standard_error() : std::numeric_limits<Real>::quiet_NaN();
    return {row.ratio, row.covariance, row.innovation, row.statistic, error, row.alarm, {}};
  }

  static py::dtype dtype() {
    FieldList fields = common_fields<HandoverRow, Real>();
    fields.add<Real>("standard_error", offsetof(HandoverRow, standard_error));
    fields.add<bool>("alarm", offsetof(HandoverRow, alarm));
    return fields.dtype(sizeof(HandoverRow));
  }
};
