// How often what the service identifies of the rig lies as near to the truth as its standard errors say.

#include <array>
#include <string>
#include <vector>

#include "server/identification/session/structural_identification.h"
#include "server/identification/session/tool_identification.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/simulated_session.h"
#include "tests/measure/study/uncertainty/coverage.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

namespace {

/// Counts the parameters of this name.
void count(const SessionResult& session, const std::string& name, double truth, Coverage& coverage) {
  for (const rt::EstimatedParameter& p : session.progress.parameters) {
    if (p.name == name) coverage.add(p.value - truth, p.standard_error);
  }
}

}  // namespace

void run_parameter_coverage(StudyContext& context) {
  const std::uint64_t seeds = context.quick ? 4 : 40;
  Coverage mass, centre, stiffness;
  for (const std::string device : {"phantom_1_0", "phantom_1_5_high_force"}) {
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      sim::SimulationConfig config{.device = device, .object = "none"};
      config.seed = seed;
      const hal::Vector3 centre_mm{2.0, -3.0, -18.0};
      config.tool_centre_mm = centre_mm;
      identification::ToolIdentification tool({}, test::value_of(create_rig(config))->info());
      const SessionResult of_tool = run_session(tool, config, 60.0);
      count(of_tool, "mass_g", config.tool_mass_g, mass);
      count(of_tool, "centre_x_mm", centre_mm.x, centre);
      count(of_tool, "centre_y_mm", centre_mm.y, centre);
      count(of_tool, "centre_z_mm", centre_mm.z, centre);
      if (seed > seeds / 2) continue;  // it takes minutes of the rig's time
      config.tool_centre_mm.reset();
      const hal::RigInfo info = test::value_of(create_rig(config))->info();
      identification::StructuralIdentification structure({.constant = true}, info);
      count(run_session(structure, config, 240.0), "structural_stiffness_n_per_mm",
            info.device.structural_stiffness_n_per_mm, stiffness);
    }
  }
  report::MarkdownTable table({"parameter", "within 1 %", "within 2 %", "rms of error / standard error"});
  const auto add = [&](const std::string& name, const Coverage& coverage) {
    coverage.report(context.report, name);
    table.add_row({name, coverage.text(1.0), coverage.text(2.0), report::fixed(coverage.rms(), 2)});
  };
  add("tool's mass", mass);
  add("tool's centre of mass", centre);
  add("structural stiffness", stiffness);
  context.report.add_table("parameter_coverage",
                           "The rig's parameters: how often the error is within its standard error", table,
                           "Identified by the service, each with another seed, both devices.");
}

}  // namespace hapticd::study
