#include <cmath>
#include <string>
#include <tuple>

#include "rt/inclusion/rendered_inclusions.h"
#include "rt/signal/vector.h"
#include "tests/measure/study/tumour/tumour_study.h"
#include "tests/measure/study/tumour/tumour_trial.h"

namespace hapticd::study {

namespace {

struct Fed {
  double jump_n = 0.0;  ///< largest second difference of the force, tick to tick
  double largest_n = 0.0;
  double work_n_mm = 0.0;   ///< done on the tip over a closed path; above 0 energy was made
  double scale_n_mm = 0.0;  ///< size of that work, without sign
};

/// The law alone on a path: tip positions a millisecond apart, from a plane surface at z = 0.
template <class Path>
Fed feed(const rt::InclusionParameters& inclusion, double seconds, Path&& path) {
  rt::RenderedInclusions law({inclusion});
  Fed fed;
  hal::Vector3 tip_before = path(0.0), force_before, force_earlier;
  const int ticks = static_cast<int>(1e3 * seconds);
  for (int i = 0; i <= ticks; ++i) {
    const hal::Vector3 tip = path(1e-3 * i);
    rt::Indentation at{tip, {0.0, 0.0, 1.0}, std::max(0.0, -tip.z), -(tip.z - tip_before.z) * 1e3};
    const hal::Vector3 force = law.update(at);
    if (i > 1) fed.jump_n = std::max(fed.jump_n, rt::norm(force - force_before * 2.0 + force_earlier));
    const double work = 0.5 * dot(force + force_before, tip - tip_before);
    fed.work_n_mm += work;
    fed.scale_n_mm += std::abs(work);
    fed.largest_n = std::max(fed.largest_n, rt::norm(force));
    force_earlier = force_before;
    force_before = force;
    tip_before = tip;
  }
  return fed;
}

}  // namespace

void run_tumour_bounds(StudyContext& context) {
  using report::fixed;
  report::MarkdownTable table(
      {"path", "variant", "jump N per tick", "largest N", "work made N·mm", "of N·mm"});
  rt::InclusionParameters inclusion = identified_tumour("phantom_hard").by_scan.inclusion;
  const double l0 = rt::norm(inclusion.place_mm - inclusion.surface_mm);
  inclusion.surface_mm = {};
  inclusion.place_mm = {0.0, 0.0, -l0};
  const auto down = [](double t, double depth, double seconds) {
    return -0.5 * depth * (1.0 - std::cos(2.0 * M_PI * t / seconds));
  };
  for (const bool published : {false, true}) {
    inclusion.variant = published ? rt::InclusionVariant::kPublished : rt::InclusionVariant::kEnergy;
    for (const double friction : {0.0, 0.15}) {
      if (published && friction > 0.0) continue;
      inclusion.internal_friction = friction;
      const std::string variant = published        ? "published"
                                  : friction > 0.0 ? "energy, internal friction"
                                                   : "energy";
      const auto add = [&](const char* name, const Fed& fed) {
        table.add_row({name, variant, fixed(fed.jump_n, 4), fixed(fed.largest_n, 1), fixed(fed.work_n_mm, 3),
                       fixed(fed.scale_n_mm, 1)});
        for (const auto& [figure_name, value, unit] :
             {std::tuple{"tumour_force_jump_n", fed.jump_n, "N"},
              {"tumour_largest_force_n", fed.largest_n, "N"},
              {"tumour_work_made", fed.work_n_mm / std::max(1e-9, fed.scale_n_mm), "1"}}) {
          report::Figure figure{figure_name, {{"path", name}, {"variant", variant}}};
          figure.value = value;
          figure.unit = unit;
          context.report.add(figure);
        }
      };
      add("press over it, 100 mm/s", feed(inclusion, 0.4, [&](double t) {
            return hal::Vector3{0.0, 0.0, down(t, 12.0, 0.4)};
          }));
      add("press 10 mm off the axis", feed(inclusion, 0.4, [&](double t) {
            return hal::Vector3{10.0, 0.0, down(t, 12.0, 0.4)};
          }));
      add("rub across l_0, 100 mm/s", feed(inclusion, 4.0, [&](double t) {
            return hal::Vector3{-20.0 * std::cos(2.0 * M_PI * t / 1.26), 0.0, down(t, 10.0, 4.0)};
          }));
      add("past the tumour", feed(inclusion, 4.0, [&](double t) {
            return hal::Vector3{0.5, 0.0, down(t, 60.0, 4.0)};
          }));
      add("loop around, press off the axis, leave over it", feed(inclusion, 2.0, [&](double t) {
            return hal::Vector3{10.0 * (1.0 - t / 2.0), 0.0, down(t, 10.0, 2.0)};
          }));
    }
  }
  context.report.add_table("tumour_bounds", "Jumps, bounds and energy of the rendered tumour", table,
                           "The law alone on a plane; jump: second difference of the force, so that a fast "
                           "press is none.");
}

}  // namespace hapticd::study
