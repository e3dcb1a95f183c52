#include "tests/measure/study/precision/integration/press_integrators.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace hapticd::study {

namespace {

/// Integrators of PressState by its rate of change.
class ByRate : public PressIntegrator {
 public:
  ByRate(const PressPlant& plant, const PressState& start, double step_s)
      : equations_(plant), s_(start), step_s_(step_s) {}

  void step(double time_s, double wanted_n) noexcept override {
    s_ = next(time_s, wanted_n);
    equations_.follow_surface(s_, step_s_, attached_, surface_mm_);
  }
  double motor_mm() const noexcept override { return s_.motor_mm; }
  double tip_mm() const noexcept override { return s_.tip_mm; }
  double tip_mm_per_s() const noexcept override { return s_.tip_mm_per_s; }
  double contact_n() const noexcept override { return equations_.contact_n(s_, attached_); }

 protected:
  virtual PressState next(double time_s, double wanted_n) noexcept = 0;
  PressState rate(const PressState& s, double time_s, double wanted_n) const noexcept {
    return equations_.rate(s, time_s, wanted_n, attached_, surface_mm_);
  }

  PressEquations equations_;
  PressState s_;
  double step_s_;
  bool attached_ = false;
  double surface_mm_ = 0.0;
};

class ExplicitEuler final : public ByRate {
 public:
  using ByRate::ByRate;
  std::unique_ptr<PressIntegrator> clone() const override { return std::make_unique<ExplicitEuler>(*this); }

 private:
  PressState next(double time_s, double wanted_n) noexcept override {
    return s_.plus(step_s_, rate(s_, time_s, wanted_n));
  }
};

class RungeKutta4 final : public ByRate {
 public:
  using ByRate::ByRate;
  std::unique_ptr<PressIntegrator> clone() const override { return std::make_unique<RungeKutta4>(*this); }

 private:
  PressState next(double time_s, double wanted_n) noexcept override {
    const double h = step_s_;
    const PressState k1 = rate(s_, time_s, wanted_n);
    const PressState k2 = rate(s_.plus(0.5 * h, k1), time_s + 0.5 * h, wanted_n);
    const PressState k3 = rate(s_.plus(0.5 * h, k2), time_s + 0.5 * h, wanted_n);
    const PressState k4 = rate(s_.plus(h, k3), time_s + h, wanted_n);
    return s_.plus(h / 6.0, k1).plus(h / 3.0, k2).plus(h / 3.0, k3).plus(h / 6.0, k4);
  }
};

/// The exact solution of the linear part that the methods of the simulator share.
class ByAxis : public PressIntegrator {
 public:
  ByAxis(const PressPlant& plant, const PressState& start, double step_s, double pull_at)
      : plant_(plant),
        axis_(plant.axis, step_s),
        s_{start.motor_mm, start.motor_mm_per_s, start.tip_mm, start.tip_mm_per_s},
        amplifier_n_(start.amplifier_n),
        lag_(2.0 * std::numbers::pi * plant.amplifier_pole_hz * step_s),
        decay_(std::exp(-lag_)),
        step_s_(step_s),
        pull_after_s_(pull_at * step_s) {}

  double motor_mm() const noexcept override { return s_.motor_mm; }
  double tip_mm() const noexcept override { return s_.tip_mm; }
  double tip_mm_per_s() const noexcept override { return s_.tip_mm_per_s; }
  double contact_n() const noexcept override { return contact_n_; }

 protected:
  /// The step without contact: amplifier, structure, hand, friction.
  sim::AxisState free_step(double time_s, double wanted_n) noexcept {
    double mean_n = amplifier_n_;
    if (lag_ > 0.0) {
      const double behind_n = amplifier_n_ - wanted_n;
      amplifier_n_ = wanted_n + behind_n * decay_;
      mean_n = wanted_n + behind_n * ((1.0 - decay_) / lag_);
    }
    sim::AxisState next = axis_.advance(s_, mean_n, plant_.hand_pull_n(time_s + pull_after_s_));
    const double stopping_n = -next.motor_mm_per_s / axis_.motor_velocity_per_motor_force();
    axis_.add_motor_force(next, std::clamp(stopping_n, -plant_.coulomb_n, plant_.coulomb_n));
    return next;
  }

  PressPlant plant_;
  sim::AxisDynamics axis_;
  sim::AxisState s_;
  double amplifier_n_;
  double lag_;
  double decay_;
  double step_s_;
  double pull_after_s_;
  double contact_n_ = 0.0;
};

class Shipped final : public ByAxis {
 public:
  Shipped(const PressPlant& plant, const PressState& start, double step_s, double pull_at)
      : ByAxis(plant, start, step_s, pull_at), material_(plant.material, step_s) {}
  std::unique_ptr<PressIntegrator> clone() const override { return std::make_unique<Shipped>(*this); }

  void step(double time_s, double wanted_n) noexcept override {
    sim::AxisState next = free_step(time_s, wanted_n);
    if (plant_.has_object) {
      const sim::Material::Step touched = material_.advance(next.tip_mm, axis_.tip_position_per_tip_force());
      axis_.add_tip_force(next, -touched.mean_force_n);
      contact_n_ = touched.force_n;
    }
    s_ = next;
  }

 private:
  sim::Material material_;
};

}  // namespace

std::string name_of(IntegrationMethod method) {
  switch (method) {
    case IntegrationMethod::kShipped:
      return "exact, implicit contact";
    case IntegrationMethod::kShippedAtMiddle:
      return "exact, implicit contact, hand at middle";
    case IntegrationMethod::kExplicitEuler:
      return "explicit Euler";
    case IntegrationMethod::kRungeKutta4:
      return "Runge-Kutta 4";
  }
  return "?";
}

const std::vector<IntegrationMethod>& integration_methods() {
  using enum IntegrationMethod;
  static const std::vector<IntegrationMethod> all{kShipped, kShippedAtMiddle, kExplicitEuler, kRungeKutta4};
  return all;
}

std::unique_ptr<PressIntegrator> make_integrator(IntegrationMethod method, const PressPlant& plant,
                                                 const PressState& start, double step_s) {
  switch (method) {
    case IntegrationMethod::kShipped:
      return std::make_unique<Shipped>(plant, start, step_s, 1.0);
    case IntegrationMethod::kShippedAtMiddle:
      return std::make_unique<Shipped>(plant, start, step_s, 0.5);
    case IntegrationMethod::kExplicitEuler:
      return std::make_unique<ExplicitEuler>(plant, start, step_s);
    case IntegrationMethod::kRungeKutta4:
      return std::make_unique<RungeKutta4>(plant, start, step_s);
  }
  throw std::invalid_argument("no such method");
}

}  // namespace hapticd::study
