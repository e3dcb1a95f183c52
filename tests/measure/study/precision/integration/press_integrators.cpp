#include "tests/measure/study/precision/integration/press_integrators.h"

#include <Eigen/Dense>
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

class SemiImplicitEuler final : public ByRate {
 public:
  using ByRate::ByRate;
  std::unique_ptr<PressIntegrator> clone() const override {
    return std::make_unique<SemiImplicitEuler>(*this);
  }

 private:
  PressState next(double time_s, double wanted_n) noexcept override {
    PressState after = s_.plus(step_s_, rate(s_, time_s, wanted_n));
    after.motor_mm = s_.motor_mm + step_s_ * after.motor_mm_per_s;
    after.tip_mm = s_.tip_mm + step_s_ * after.tip_mm_per_s;
    return after;
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

/// The state at the middle of the step is affine in the contact force, which leaves one increasing scalar
/// equation for it.
class ImplicitMidpoint final : public ByRate {
 public:
  ImplicitMidpoint(const PressPlant& plant, const PressState& start, double step_s)
      : ByRate(plant, start, step_s) {
    const sim::AxisParameters& p = plant.axis;
    const double per_motor = 1e3 / p.motor_mass_kg;
    const double per_tip = 1e3 / p.tip_mass_kg;
    const double k = p.structural_stiffness_n_per_mm;
    const double c = p.structural_damping_n_s_per_mm;
    Eigen::Matrix4d rates = Eigen::Matrix4d::Zero();
    rates(0, 1) = 1.0;
    rates(2, 3) = 1.0;
    rates.row(1) << -k * per_motor, -(c + p.motor_viscosity_n_s_per_mm) * per_motor, k * per_motor,
        c * per_motor;
    rates.row(3) << k * per_tip, c * per_tip, -(k + p.hand_stiffness_n_per_mm) * per_tip,
        -(c + p.hand_damping_n_s_per_mm) * per_tip;
    to_middle_ = (Eigen::Matrix4d::Identity() - 0.5 * step_s * rates).inverse();
    per_motor_n_ = to_middle_ * Eigen::Vector4d(0.0, 0.5 * step_s * per_motor, 0.0, 0.0);
    per_tip_n_ = to_middle_ * Eigen::Vector4d(0.0, 0.0, 0.0, 0.5 * step_s * per_tip);
  }
  std::unique_ptr<PressIntegrator> clone() const override {
    return std::make_unique<ImplicitMidpoint>(*this);
  }

 private:
  PressState next(double time_s, double wanted_n) noexcept override {
    const double half_s = 0.5 * step_s_;
    const PressPlant& plant = equations_.plant();
    const double lag = half_s * 2.0 * std::numbers::pi * plant.amplifier_pole_hz;
    const double amplifier_n = (s_.amplifier_n + lag * wanted_n) / (1.0 + lag);
    const Eigen::Vector4d before(s_.motor_mm, s_.motor_mm_per_s, s_.tip_mm, s_.tip_mm_per_s);
    Eigen::Vector4d middle =
        to_middle_ * before + per_motor_n_ * amplifier_n + per_tip_n_ * plant.hand_pull_n(time_s + half_s);
    const double stopping_n = (0.5 * s_.motor_mm_per_s - middle[1]) / per_motor_n_[1];
    middle += per_motor_n_ * std::clamp(stopping_n, -plant.coulomb_n, plant.coulomb_n);

    PressState at_middle = s_;
    const auto put = [&](double force_n) {
      at_middle.tip_mm = middle[2] - per_tip_n_[2] * force_n;
      at_middle.tip_mm_per_s = middle[3] - per_tip_n_[3] * force_n;
      const bool touching = attached_ || at_middle.tip_mm >= surface_mm_;
      at_middle.branch_n =
          equations_.branches_at_middle(s_, touching ? at_middle.tip_mm : surface_mm_, half_s);
      return equations_.contact_n(at_middle, touching);
    };
    double contact_n = 0.0;
    if (plant.has_object) {
      // What the law gives falls as the force that is put in rises: regula falsi (Illinois) on the
      // difference.
      double low = 0.0;
      double below = -put(0.0);
      if (below < 0.0) {
        double high = -below;
        double above = high - put(high);
        contact_n = high;
        for (int i = 0; i < 60 && high - low > 1e-12 * (1.0 + high) && above != 0.0; ++i) {
          contact_n = (low * above - high * below) / (above - below);
          const double difference = contact_n - put(contact_n);
          if (std::abs(difference) < 1e-12) break;
          if (difference > 0.0) {
            high = contact_n;
            above = difference;
            below *= 0.5;
          } else {
            low = contact_n;
            below = difference;
            above *= 0.5;
          }
        }
      }
      put(contact_n);
    }
    middle -= per_tip_n_ * contact_n;
    const Eigen::Vector4d after = 2.0 * middle - before;
    PressState s;
    s.motor_mm = after[0];
    s.motor_mm_per_s = after[1];
    s.tip_mm = after[2];
    s.tip_mm_per_s = after[3];
    s.amplifier_n = 2.0 * amplifier_n - s_.amplifier_n;
    for (std::size_t i = 0; i < s.branch_n.size(); ++i) {
      s.branch_n[i] = 2.0 * at_middle.branch_n[i] - s_.branch_n[i];
    }
    return s;
  }

  Eigen::Matrix4d to_middle_;
  Eigen::Vector4d per_motor_n_;  ///< state at the middle per newton on the motor side
  Eigen::Vector4d per_tip_n_;
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

class ExplicitContact final : public ByAxis {
 public:
  ExplicitContact(const PressPlant& plant, const PressState& start, double step_s)
      : ByAxis(plant, start, step_s, 0.5), equations_(plant) {}
  std::unique_ptr<PressIntegrator> clone() const override { return std::make_unique<ExplicitContact>(*this); }

  void step(double time_s, double wanted_n) noexcept override {
    const PressState before = touching_state();
    const bool touching = attached_ || before.tip_mm >= surface_mm_;
    sim::AxisState next = free_step(time_s, wanted_n);
    axis_.add_tip_force(next, -contact_n_);
    // Memory fades exactly towards what the depth at the beginning asks for.
    const double elastic = equations_.elastic_n(std::max(0.0, touching ? before.tip_mm : surface_mm_));
    for (std::size_t i = 0; i < branch_n_.size(); ++i) {
      const sim::RelaxationBranch& branch = plant_.material.branches[i];
      const double settled = -branch.share * elastic;
      branch_n_[i] = settled + (branch_n_[i] - settled) * std::exp(-step_s_ / branch.time_s);
    }
    s_ = next;
    const PressState after = touching_state();
    equations_.follow_surface(after, step_s_, attached_, surface_mm_);
    contact_n_ = equations_.contact_n(after, attached_);
  }

 private:
  PressState touching_state() const noexcept {
    PressState s;
    s.tip_mm = s_.tip_mm;
    s.tip_mm_per_s = s_.tip_mm_per_s;
    s.branch_n = branch_n_;
    return s;
  }

  PressEquations equations_;
  std::array<double, 3> branch_n_{};
  bool attached_ = false;
  double surface_mm_ = 0.0;
};

}  // namespace

std::string name_of(IntegrationMethod method) {
  switch (method) {
    case IntegrationMethod::kShipped:
      return "exact, implicit contact";
    case IntegrationMethod::kShippedAtMiddle:
      return "exact, implicit contact, hand at middle";
    case IntegrationMethod::kExplicitContact:
      return "exact, explicit contact, hand at middle";
    case IntegrationMethod::kExplicitEuler:
      return "explicit Euler";
    case IntegrationMethod::kSemiImplicitEuler:
      return "semi-implicit Euler";
    case IntegrationMethod::kImplicitMidpoint:
      return "implicit midpoint";
    case IntegrationMethod::kRungeKutta4:
      return "Runge-Kutta 4";
  }
  return "?";
}

const std::vector<IntegrationMethod>& integration_methods() {
  using enum IntegrationMethod;
  static const std::vector<IntegrationMethod> all{kShipped,       kShippedAtMiddle,   kExplicitContact,
                                                  kExplicitEuler, kSemiImplicitEuler, kImplicitMidpoint,
                                                  kRungeKutta4};
  return all;
}

std::unique_ptr<PressIntegrator> make_integrator(IntegrationMethod method, const PressPlant& plant,
                                                 const PressState& start, double step_s) {
  switch (method) {
    case IntegrationMethod::kShipped:
      return std::make_unique<Shipped>(plant, start, step_s, 1.0);
    case IntegrationMethod::kShippedAtMiddle:
      return std::make_unique<Shipped>(plant, start, step_s, 0.5);
    case IntegrationMethod::kExplicitContact:
      return std::make_unique<ExplicitContact>(plant, start, step_s);
    case IntegrationMethod::kExplicitEuler:
      return std::make_unique<ExplicitEuler>(plant, start, step_s);
    case IntegrationMethod::kSemiImplicitEuler:
      return std::make_unique<SemiImplicitEuler>(plant, start, step_s);
    case IntegrationMethod::kImplicitMidpoint:
      return std::make_unique<ImplicitMidpoint>(plant, start, step_s);
    case IntegrationMethod::kRungeKutta4:
      return std::make_unique<RungeKutta4>(plant, start, step_s);
  }
  throw std::invalid_argument("no such method");
}

}  // namespace hapticd::study
