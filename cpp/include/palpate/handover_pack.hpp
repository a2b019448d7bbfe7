// SPDX-License-Identifier: MIT
#pragma once

// Handover::update for a pack of streams: the same operations in the same order, with selects in place of branches.

#include <palpate/estimator/handover.hpp>
#include <palpate/pack.hpp>

namespace palpate {

/// Takes a sample of each stream of a pack. Number k of the state of its first stream, in the order of
/// Handover::visit_state, is at [k * stride]; those of the other streams follow it.
///
/// If the pack is calm (no outlier, no drift, no stream in its first samples, nothing to refuse) all streams store
/// everything, otherwise each number is stored for the streams that Handover would change. Only alarms are left to
/// Handover itself.
template <class Real, std::size_t stride>
class HandoverPack {
  using Value = Pack<Real>;
  using Mask = decltype(Value{} > Value{});

 public:
  enum Number : std::size_t {
    ratio,
    information,
    squares,
    count,
    up,
    down = up + 6,
    mean = down + 6,
    mean_magnitude,
    lag0,
    lag1,
    lag2,
    learnt,
    before,
    before_that,
    rho,
    offset,
    roughness,
    until_forecast,
    seen,
    numbers
  };

  /// The streams of the pack, one bit each, that did not take their sample.
  struct Exceptions {
    unsigned refused;  // their state is as before
    unsigned alarmed;  // an alarm at this sample or the one before, or an overflow: their state is void
  };

  explicit HandoverPack(const HandoverSettings<Real>& settings) noexcept
      : settings_(settings), settled_(64 + 1 / settings.smoothing) {}

  /// If a stream is alarmed, `old` has the states before.
  Exceptions update(Real* at, const Real* output, const Real* regressor, Value* old) const noexcept {
    const Value y = load<Value>(output), x = load<Value>(regressor);
    const Value innovation = y - product(x, get(at, ratio));
    const Value forecast = product(get(at, rho), get(at, before));
    const Sample s{y, x, weight(get(at, mean), x), innovation, forecast, innovation - forecast};
    const Value scale = least_scale(product(all(1.2533141), get(at, mean_magnitude)), y);
    const Mask calm = (magnitude(s.whitened) <= product(all(settings_.clip), scale)) &
                      (magnitude(get(at, offset)) <= allowed_offset(at)) & (get(at, seen) >= all(settled_));
    if (PALPATE_UNLIKELY(!holds_everywhere<Real>(calm))) {
      return take_general(at, s, old);
    }
    const Judged judged{s.whitened, scale, innovation, all(settings_.steady), all(0.02), all(settings_.smoothing),
                        all(8)};
    return take<true>(at, s, judged, Streams(), old);
  }

 private:
  struct Sample {
    Value output, regressor, weight, innovation, forecast, whitened;
  };
  struct Judged {
    Value clipped, scale, counted, forgetting, magnitude_share, instrument_share, interval;
  };
  /// Those whose sample is accepted; is one for the CUSUM; changes the ratio; the scale; the offset; the lags.
  struct Streams {
    Mask taken, watched, moved, scaled, followed, added;
  };

  template <class Number>
  static Value all(Number value) noexcept {
    return static_cast<Real>(value) - Value{};  // exact, -0 included
  }
  static Value get(const Real* at, std::size_t number) noexcept { return load<Value>(at + number * stride); }
  static void put(Real* at, std::size_t number, Value value) noexcept { store(value, at + number * stride); }
  template <bool calm>
  PALPATE_INLINE static void put(Real* at, std::size_t number, Mask where, Value value) noexcept {
    put(at, number, calm ? value : select(where, value, get(at, number)));
  }

  /// As Instrument::weight; one comparison for w < 4 x and x < 4 w.
  static Value weight(Value w, Value x) noexcept {
    const Value a = magnitude(w), b = magnitude(x);
    return select((product(w, x) > Value{}) & (larger(a, b) < Real(4) * smaller(a, b)), w, x);
  }
  static Value least_scale(Value scale, Value y) noexcept {
    return larger(scale, product(magnitude(y) + Real(1e-18), all(is_float ? 1e-6 : 1e-15)));
  }
  static Value allowed_offset(const Real* at) noexcept { return product(all(2), get(at, roughness)); }
  static Mask in_range(Value value) noexcept { return magnitude(value) < all(most); }

  Judged judge(const Real* at, const Sample& s, Streams& streams) const noexcept {
    const Value n = get(at, seen), one = all(1);
    const Mask taken = in_range(s.output) & in_range(s.regressor) & in_range(s.innovation);
    const Mask watched = n >= all(8),
               drifts = (magnitude(get(at, offset)) > allowed_offset(at)) & (get(at, learnt) >= all(16));
    const Value scale =
        least_scale(product(product(all(1.2533141), get(at, mean_magnitude)), doubt(n, watched)), s.output);
    const Value limit = product(all(settings_.clip), scale);
    const Mask outlier = watched & (magnitude(s.whitened) > limit), learns = taken & (n >= all(3));
    const Value clipped = select(watched, larger(-limit, smaller(limit, s.whitened)), s.whitened);
    const Mask held = without(outlier, drifts);
    streams = {taken,
               static_cast<Mask>(taken & watched),
               without(taken, held),
               learns,
               without(learns, held),
               without(learns, outlier)};
    const Value magnitudes = n - all(2), regressors = n + one;
    return {clipped,
            scale,
            select(outlier, s.forecast + clipped, s.innovation),
            forgetting(at, drifts),
            mean_share(magnitudes, all(0.02)),
            mean_share(regressors, all(settings_.smoothing)),
            select(regressors < all(32), one, all(8))};
  }

  /// As Handover::drifting where the ratio drifts.
  Value forgetting(const Real* at, Mask drifts) const noexcept {
    const Value steady = all(settings_.steady), one = all(1), w = get(at, mean);
    if (lanes_in<Real>(drifts) == 0) {
      return steady;
    }
    const Value share = smaller(magnitude(get(at, offset)) / get(at, roughness) - all(2), all(0.9));
    return select(drifts, smaller(product(w, w) * (one / share - one) / get(at, information), steady), steady);
  }

  static Value doubt(Value n, Mask watched) noexcept {
    const Mask few = watched & (n < all(64));
    return lanes_in<Real>(few) == 0 ? all(1) : select(few, all(1) + all(3) / (n - all(2)), all(1));
  }

  static Value mean_share(Value n, Value smoothing) noexcept {
    const Mask few = product(n, smoothing) < all(1);
    return lanes_in<Real>(few) == 0 ? smoothing : select(few, all(1) / n, smoothing);
  }

  Exceptions take_general(Real* at, const Sample& s, Value* old) const noexcept {
    Streams streams;
    const Judged judged = judge(at, s, streams);
    return take<false>(at, s, judged, streams, old);
  }

  template <bool calm>
  PALPATE_INLINE Exceptions take(Real* at, const Sample& s, const Judged& j, const Streams& streams,
                                 Value* old) const noexcept {
    const Terms<Value> terms = terms_of(WeightedSample<Value>{s.weight, s.output, s.regressor});
    const Value z = j.clipped / j.scale, rise = z - all(settings_.drift), fall = -z - all(settings_.drift);
    const Value sum =
        larger(product(j.forgetting, get(at, information)) + terms.information, all(settings_.min_information));
    const Value next = get(at, ratio) + product(s.weight / sum, j.counted);
    const Value highest = larger(larger(get(at, up) + rise, get(at, up)), larger(get(at, down) + fall, get(at, down)));
    const Value size = magnitude(s.output) + magnitude(s.regressor) + magnitude(s.innovation) + magnitude(next);
    const unsigned ordinary = lanes_in<Real>((highest <= all(settings_.threshold)) & (size < all(most)));
    const unsigned taken = calm ? all_lanes<Real> : lanes_in<Real>(streams.taken);
    const Exceptions exceptions{all_lanes<Real> & ~taken, taken & ~ordinary};
    if (PALPATE_UNLIKELY(exceptions.alarmed != 0)) {
      for (std::size_t k = 0; k < numbers; ++k) {
        old[k] = get(at, k);
      }
    }
    put<calm>(at, ratio, streams.moved, next);
    put<calm>(at, information, streams.moved, sum);
    estimate<calm>(at, terms.square, j.forgetting, streams.moved);
    detect<calm>(at, up, rise, terms, streams.watched);
    detect<calm>(at, down, fall, terms, streams.watched);
    learn<calm>(at, s, j, streams);
    put<calm>(at, mean, streams.taken, get(at, mean) + product(j.instrument_share, s.regressor - get(at, mean)));
    put<calm>(at, seen, streams.taken, get(at, seen) + all(1));
    return exceptions;
  }

  template <bool calm>
  PALPATE_INLINE static void estimate(Real* at, Value square, Value forgetting, Mask moved) noexcept {
    put<calm>(at, squares, moved, product(product(forgetting, forgetting), get(at, squares)) + square);
    put<calm>(at, count, moved, product(forgetting, get(at, count)) + all(1));
  }

  template <bool calm>
  PALPATE_INLINE void detect(Real* at, std::size_t side, Value step, const Terms<Value>& terms,
                             Mask watched) const noexcept {
    CusumSide<Value> next{get(at, side), get(at, side + 1), get(at, side + 2), {}};
    next.sums = {get(at, side + 3), get(at, side + 4), get(at, side + 5)};
    next.add(step, all(settings_.guard), terms);
    next.visit_state([at, &side, watched](const Value& number) { put<calm>(at, side++, watched, number); });
  }

  /// As Handover::learn.
  template <bool calm>
  PALPATE_INLINE static void learn(Real* at, const Sample& s, const Judged& j, const Streams& streams) noexcept {
    const Value e = s.innovation, last = get(at, before);
    const auto approach = [at](Number number, Mask where, Value share, Value value) {
      put<calm>(at, number, where, get(at, number) + product(share, value - get(at, number)));
    };
    const auto add = [at, &streams](Number number, Value value) {
      put<calm>(at, number, streams.added, product(all(0.995), get(at, number)) + value);
    };
    approach(mean_magnitude, streams.scaled, j.magnitude_share, magnitude(j.clipped));
    approach(offset, streams.followed, all(0.0625), j.counted);
    approach(roughness, streams.followed, all(0.03125), magnitude(j.counted - last));
    add(lag0, product(e, e));
    add(lag1, product(e, last));
    add(lag2, product(e, get(at, before_that)));
    add(learnt, all(1));
    put<calm>(at, before_that, streams.scaled, last);
    put<calm>(at, before, streams.scaled, j.counted);
    forecast<calm>(at, j.interval, streams.added);
  }

  /// The forecast again, where that is due: as InnovationNoise::add.
  template <bool calm>
  PALPATE_INLINE static void forecast(Real* at, Value interval, Mask added) noexcept {
    const Value until = get(at, until_forecast) - all(1);
    put<calm>(at, until_forecast, added, until);
    const Mask later = until > Value{};
    const unsigned due = ~lanes_in<Real>(later) & (calm ? all_lanes<Real> : lanes_in<Real>(added));
    if (PALPATE_UNLIKELY(due != 0)) {
      const Mask where = calm ? without(Value{} == Value{}, later) : without(added, later);
      const Value r1 = select(get(at, lag0) > Value{}, get(at, lag1) / get(at, lag0), Value{});
      const Value r = r1 + (all(1) + product(all(3), r1)) / get(at, learnt), limit = all(Real(31) / Real(33));
      put(at, until_forecast, select(where, interval, get(at, until_forecast)));
      put(at, rho, select(where, larger(-limit, smaller(limit, r)), get(at, rho)));
    }
  }

  static constexpr bool is_float = std::is_same_v<Real, float>;
  static constexpr Real most = is_float ? Real(1e16) : Real(1e140);  // as Handover::in_range
  HandoverSettings<Real> settings_;
  Real settled_;  // samples before a pack can be calm
};

}  // namespace palpate
