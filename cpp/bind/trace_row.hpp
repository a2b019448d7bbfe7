// SPDX-License-Identifier: MIT
#pragma once

// One row of trace(). The padding is a member, so that equal traces have equal bytes.

#include <cstddef>
#include <cstring>
#include <limits>
#include <palpate/estimator/rls.hpp>

#include "fields.hpp"

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

/// Field by field into its place: a row made elsewhere and copied would wait for its own parts to be stored.
template <class Row, class Core, class Real>
void take_common(Row& row, const Core& core, const palpate::Step<Real>& step) {
  row.ratio = core.ratio();
  row.covariance = core.covariance();
  row.innovation = step.accepted ? step.innovation : std::numeric_limits<Real>::quiet_NaN();
  row.statistic = core.statistic();
  row.alarm = core.alarm();
  std::memset(row.padding, 0, sizeof(row.padding));
}

template <class Real>
struct TraceRow {
  Real ratio, covariance, innovation, statistic;
  bool alarm;
  unsigned char padding[sizeof(Real) - 1];

  template <class Core>
  void take(const Core& core, const palpate::Step<Real>& step) {
    take_common(*this, core, step);
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
  void take(const Core& core, const palpate::Step<Real>& step) {
    take_common(*this, core, step);
    standard_error = core.settled() ? core.standard_error() : std::numeric_limits<Real>::quiet_NaN();
  }

  static py::dtype dtype() {
    FieldList fields = common_fields<HandoverRow, Real>();
    fields.add<Real>("standard_error", offsetof(HandoverRow, standard_error));
    fields.add<bool>("alarm", offsetof(HandoverRow, alarm));
    return fields.dtype(sizeof(HandoverRow));
  }
};
