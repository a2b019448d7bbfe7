// SPDX-License-Identifier: MIT
#pragma once

// Weighted least squares for several coefficients, a sample at a time, with their covariance.

#include <palpate/arithmetic.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// A sample of weight 1; or what the rotations leave of it: each regressor without those before it, the output without
/// all of them, and the weight of this residual.
template <class Real, int Size>
struct Observation {
  Real regressors[Size] = {}, output = 0, weight = 1;
};

/// U' D U = sum of weight x x', U upper triangular with a diagonal of 1, and U theta = z, by square-root-free Givens
/// rotations (Gentleman, Journal of the Institute of Mathematics and its Applications 12, 1973). The normal equations are
/// never formed, so the error of theta grows with the condition of the regressors, not with its square; D stays positive.
template <class Real, int Size>
struct LeastSquares {
  using Sample = Observation<Real, Size>;
  static constexpr Real normal = std::numeric_limits<Real>::min() * 1024;
  static constexpr int above = Size * (Size - 1) / 2;
  Real coefficients[Size] = {};            // theta
  Real diagonal[Size] = {};                // D
  Real projected[Size] = {};               // z
  Real upper[above > 0 ? above : 1] = {};  // U above its diagonal, row by row
  Real squares[above + Size] = {};         // Q, sum of weight^2 x x', row by row up to the diagonal
  Real residuals = 0;                      // sum of weight (output - theta' x)^2
  Real count = 0, count_squares = 0;       // sums of weight and of weight^2

  /// Without samples: `information` in each direction, and these coefficients.
  constexpr explicit LeastSquares(Real information, const Real* about = nullptr) noexcept {
    for (int i = 0; i < Size; ++i) {
      diagonal[i] = information;
      coefficients[i] = projected[i] = about != nullptr ? about[i] : Real(0);
    }
  }

  /// After a sample. Substitution subtracts a multiple of each coefficient from the first one; infinity * 0 is NaN. What
  /// is left of a regressor, or of the output, may be too large for its square.
  constexpr bool finite() const noexcept {
    Real sum = coefficients[0] + residuals;
    for (int i = 1; i < Size; ++i) {
      sum += diagonal[i];
    }
    return is_finite(sum);
  }

  /// D, U, z and theta of `next`, which may be this one, become those after a sample, and `row` what is left of it. A
  /// regressor that is a combination of those before it, as far as 1 / resolution of its mean square can tell, says
  /// nothing; one that overflows has made a coefficient infinite or NaN.
  PALPATE_INLINE constexpr void rotate(Real forgetting, Real resolution, Sample& row,
                                       LeastSquares& next) const noexcept {
    for (int i = 0, j = 0; i < Size; ++i) {
      Real x = row.regressors[i];
      if (PALPATE_UNLIKELY(!(product(product(x, x), product(resolution, count_squares)) >= squares[i * (i + 3) / 2]))) {
        keep_apart();
        x = row.regressors[i] = 0;
      }
      const Real weighted = product(row.weight, x), discounted = product(forgetting, diagonal[i]);
      const Real sum = discounted + product(weighted, x), inverse = 1 / sum, share = product(weighted, inverse);
      next.diagonal[i] = sum;
      row.weight = product(row.weight, product(discounted, inverse));
      for (int k = i + 1; k < Size; ++k, ++j) {
        row.regressors[k] -= product(x, upper[j]);
        next.upper[j] = upper[j] + product(share, row.regressors[k]);
      }
      row.output -= product(x, projected[i]);
      next.coefficients[i] = next.projected[i] = projected[i] + product(share, row.output);
    }
    next.substitute(next.coefficients);
  }

  /// The sums of `next` become those after the sample of which `row` is left. Sums in one SIMD register take more steps.
  PALPATE_INLINE constexpr void sum_up(Real forgetting, const Sample& sample, const Sample& row,
                                       LeastSquares& next) const noexcept {
    const Real square = product(forgetting, forgetting);
    for (int i = 0, j = 0; i < Size; ++i) {
      for (int k = 0; k <= i; ++k, ++j) {
        next.squares[j] = product(square, squares[j]) + product(sample.regressors[i], sample.regressors[k]);
        keep_apart();
      }
    }
    next.count = product(forgetting, count) + 1;
    keep_apart();
    next.count_squares = product(square, count_squares) + 1;
    keep_apart();
    next.residuals = product(forgetting, residuals) + product(product(row.weight, row.output), row.output);
  }

  /// Both in one. Returns the weight of the residual, 1 / (1 + x' P x / forgetting).
  constexpr Real add(Real forgetting, Real resolution, const Sample& sample) noexcept {
    Sample row = sample;
    rotate(forgetting, resolution, row, *this);
    sum_up(forgetting, sample, row, *this);
    return row.weight;
  }

  /// Add `information` in each direction; the coefficients stay. What has decayed stays above subnormal numbers, where
  /// arithmetic takes ten times as long.
  constexpr void strengthen(Real information) noexcept {
    residuals += normal;
    for (Real& square : squares) {
      square += normal;
    }
    LeastSquares next = *this;
    for (int i = 0; i < Size; ++i) {
      Sample row;
      row.regressors[i] = 1;
      row.weight = information;
      rotate(Real(1), std::numeric_limits<Real>::infinity(), row, next);
      for (int k = 0; k < Size; ++k) {
        next.projected[k] = next.coefficients[k] = coefficients[k];
      }
      *this = next;
    }
    for (int i = 0, j = 0; i < Size; ++i) {
      for (int k = i + 1; k < Size; ++k, ++j) {
        upper[j] = magnitude(upper[j]) < normal ? Real(0) : upper[j];
        projected[i] += product(upper[j], coefficients[k]);
      }
    }
  }

  /// A column of P = (U' D U)^-1: the variances and covariances of theta for noise of variance 1, without forgetting.
  constexpr void covariance(int column, Real (&result)[Size]) const noexcept {
    for (Real& value : result) {
      value = 0;
    }
    result[column] = 1;
    for (int i = 0, j = 0; i < Size; ++i) {
      for (int k = i + 1; k < Size; ++k, ++j) {
        result[k] -= product(upper[j], result[i]);
      }
    }
    for (int i = 0; i < Size; ++i) {
      result[i] /= diagonal[i];
    }
    substitute(result);
  }

  /// Variances of theta for noise of variance 1: the diagonal of P Q P. It is at most the diagonal of P, to which it is equal
  /// without forgetting, and which replaces it where rounding hides it. NaN where `prior`, the information that no sample
  /// gave, is more than a hundredth. Returns the trace of P Q: how many coefficients the samples determine.
  constexpr Real leverages(Real (&result)[Size], Real prior) const noexcept {
    Real trace = 0;
    for (int c = 0; c < Size; ++c) {
      Real column[Size] = {}, basis[Size] = {};
      covariance(c, column);
      const Real square = quadratic(column);
      const bool determined = product(prior, column[c]) < Real(0.01);
      result[c] = !determined ? not_a_number<Real> : square < column[c] ? square : column[c];
      basis[c] = 1;
      substitute(basis, c);
      const Real share = quadratic(basis) / diagonal[c];
      trace += share < 1 ? share : Real(1);
    }
    return trace;
  }

  /// As Rls::visit_state.
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    const auto each = [&visit](auto& values) {
      for (Real& value : values) {
        visit(value);
      }
    };
    each(coefficients), each(diagonal), each(projected), each(upper), each(squares);
    visit(residuals), visit(count), visit(count_squares);
  }

 private:
  /// values = U^-1 values, the ones above `last` being 0.
  constexpr void substitute(Real (&values)[Size], int last = Size - 1) const noexcept {
    for (int i = Size - 1, j = above; i >= 0; --i) {
      for (int k = Size - 1; k > i; --k) {
        --j;
        if (k <= last) {
          values[i] -= product(upper[j], values[k]);
        }
      }
    }
  }

  /// values' Q values; NaN where rounding could be a hundredth of it.
  constexpr Real quadratic(const Real (&values)[Size]) const noexcept {
    Real sum = 0, size = 0;
    for (int i = 0, j = 0; i < Size; ++i) {
      for (int k = 0; k <= i; ++k, ++j) {
        const Real term = product(product(squares[j], values[i]), k < i ? 2 * values[k] : values[k]);
        sum += term;
        size += magnitude(term);
      }
    }
    return sum > product(size, 100 * std::numeric_limits<Real>::epsilon()) ? sum : not_a_number<Real>;
  }
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
