#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/measure/study/precision/integration/press_plant.h"

namespace hapticd::study {

/// Ways to take the equations of a press a step further.
enum class IntegrationMethod : unsigned char {
  kShipped,  ///< as Simulation does: AxisDynamics (exact), Coulomb clamped, Material implicit, the hand's
             ///< pull at the end of the step
  kShippedAtMiddle,  ///< the same, with the hand's pull taken at the middle of the step
  kExplicitEuler,    ///< s⁺ = s + h ṡ
  kRungeKutta4,      ///< the classical one
};

std::string name_of(IntegrationMethod method);
/// Methods in the order of the enumeration.
const std::vector<IntegrationMethod>& integration_methods();

/// A press as it is integrated.
class PressIntegrator {
 public:
  virtual ~PressIntegrator() = default;
  /// Another one in the same state.
  virtual std::unique_ptr<PressIntegrator> clone() const = 0;
  /// Steps from `time_s` to a step later, with the same force wanted of the motors throughout.
  virtual void step(double time_s, double wanted_n) noexcept = 0;
  virtual double motor_mm() const noexcept = 0;
  virtual double tip_mm() const noexcept = 0;
  virtual double tip_mm_per_s() const noexcept = 0;
  virtual double contact_n() const noexcept = 0;  ///< at the end of the step
};

/// Starts from `start`, out of contact.
std::unique_ptr<PressIntegrator> make_integrator(IntegrationMethod method, const PressPlant& plant,
                                                 const PressState& start, double step_s);

}  // namespace hapticd::study
