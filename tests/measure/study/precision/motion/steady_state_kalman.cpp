#include "tests/measure/study/precision/motion/steady_state_kalman.h"

#include <algorithm>
#include <cmath>

namespace hapticd::study {

namespace {

template <std::size_t N>
using Matrix = std::array<std::array<double, N>, N>;

/// Taylor's series over a tick.
template <std::size_t N>
Matrix<N> transition(double period_s) {
  Matrix<N> f{};
  for (std::size_t row = 0; row < N; ++row) {
    double factor = 1.0;
    for (std::size_t column = row; column < N; ++column) {
      f[row][column] = factor;
      factor *= period_s / static_cast<double>(column - row + 1);
    }
  }
  return f;
}

template <std::size_t N>
Matrix<N> predicted(const Matrix<N>& p, const Matrix<N>& f, const std::array<double, N>& g, double variance) {
  Matrix<N> next{};
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t j = 0; j < N; ++j) {
      next[i][j] = variance * g[i] * g[j];
      for (std::size_t a = 0; a < N; ++a) {
        for (std::size_t b = 0; b < N; ++b) next[i][j] += f[i][a] * p[a][b] * f[j][b];
      }
    }
  }
  return next;
}

}  // namespace

template <std::size_t N>
SteadyStateKalman<N>::SteadyStateKalman(double position_deviation_mm, double jump, double rate_hz) noexcept
    : period_s_(1.0 / rate_hz) {
  const Matrix<N> f = transition<N>(period_s_);
  std::array<double, N> g{0.5 * period_s_ * period_s_, period_s_};
  if (N == 3) g[N - 1] = 1.0;
  const double noise = position_deviation_mm * position_deviation_mm;
  Matrix<N> p{};
  for (std::size_t i = 0; i < N; ++i) p[i][i] = noise;
  constexpr int kMaxSteps = 100'000;
  for (int step = 0; step < kMaxSteps; ++step) {
    p = predicted<N>(p, f, g, jump * jump);
    double change = 0.0;
    for (std::size_t i = 0; i < N; ++i) {
      const double gain = p[i][0] / (p[0][0] + noise);
      change = std::max(change, std::abs(gain - gain_[i]) / gain);
      gain_[i] = gain;
    }
    const std::array<double, N> first = p[0];
    for (std::size_t i = 0; i < N; ++i) {
      for (std::size_t j = 0; j < N; ++j) p[i][j] -= gain_[i] * first[j];
    }
    if (change < 1e-13) break;
  }
}

template <std::size_t N>
void SteadyStateKalman<N>::update(double position_mm) noexcept {
  if (!started_) {
    state_ = {position_mm};
    started_ = true;
    return;
  }
  if constexpr (N == 3) {
    state_[0] += period_s_ * (state_[1] + 0.5 * period_s_ * state_[2]);
    state_[1] += period_s_ * state_[2];
  } else {
    state_[0] += period_s_ * state_[1];
  }
  const double surprise_mm = position_mm - state_[0];
  for (std::size_t i = 0; i < N; ++i) state_[i] += gain_[i] * surprise_mm;
}

template class SteadyStateKalman<2>;
template class SteadyStateKalman<3>;

}  // namespace hapticd::study
