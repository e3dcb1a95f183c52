#pragma once

#include "rt/model/models.h"
#include "server/text/range.h"

// One description of every law: key, member, and what a model file allows. It is walked to read and write
// model files, by a TomlTable or a TomlWriter, and stored models, by the archives of model_archive.h. A field
// that is added to a law does not compile until it is described: the bindings name all fields.
namespace hapticd::server::model_archive {

template <class A>
void describe(A& archive, rt::HuntCrossleyParameters& law) {
  auto& [stiffness, damping, exponent] = law;
  archive.field("stiffness_n_per_mm_m", stiffness, Range{1e-4, 1e3, "N/mm^m"});
  archive.field("damping_n_s_per_mm_m1", damping, Range{0.0, 1e2, "N·s/mm^(m+1)"});
  archive.field("exponent", exponent, Range{1.0, 3.0, ""});
}

template <class A>
void describe(A& archive, rt::CreepParameters& law) {
  auto& [time_s, weight, displacement_mm, max_force_n] = law;
  archive.field("time_s", time_s, Range{1e-4, 1e3, "s"});
  archive.field("weight", weight, Range{0.0, 1e3, ""});
  archive.field("max_force_n", max_force_n, Range{1e-3, 1e3, "N"});
  archive.field("displacement_mm", displacement_mm, Range{0.0, 1e3, "mm"});
}

template <class A>
void describe(A& archive, rt::MaxwellSlipParameters& elements) {
  auto& [reach_mm, stiffness_per_mm] = elements;
  archive.field("reach_mm", reach_mm, Range{0.0, 1e3, "mm"});
  archive.field("stiffness_per_mm", stiffness_per_mm, Range{0.0, 1e4, "1/mm"});
}

/// Fields that every friction law has. The others are optional in a model file. The deviation of the presliding
/// distance is a key of its section there, and one of the parameters in a stored model.
template <class A>
void describe(A& archive, rt::FrictionParameters& friction) {
  auto& [kinetic, presliding_mm, viscous, exponent, maxwell_slip, presliding_relative_error] = friction;
  archive.field("kinetic", kinetic, Range{0.0, 5.0, ""});
  archive.field("presliding_mm", presliding_mm, Range{1e-3, 20.0, "mm"});
  archive.field("viscous_n_s_per_mm", viscous, Range{0.0, 1.0, "N·s/mm"});
}

}  // namespace hapticd::server::model_archive
