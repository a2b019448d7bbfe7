// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace palpate::rows {

/// palpate.Sample as the ring carries it and a recording keeps it. The padding is a member, so that equal samples have
/// equal bytes.
struct Row {
  std::int64_t seq, t_hard_ns, t_soft_ns;
  std::int32_t hard_raw, soft_raw;
  double hard, soft;
  std::uint8_t status;
  unsigned char padding[3];
  std::int32_t t_uncertainty_us;

  static constexpr std::uint8_t last_status = 8;
};

}  // namespace palpate::rows
