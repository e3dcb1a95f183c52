// The study-wide plant, and what real silicone says about the general law.

#include "tests/measure/study/common/plant.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "hal/sim/object/general_material.h"
#include "tests/measure/study/common/recording_set.h"
#include "tests/support/value_of.h"

namespace hapticd::study {
namespace {

TEST(StudyPlant, RigsAreOfTheCurrentOne) {
  for (const sim::Plant plant : {sim::Plant::kGeneral, sim::Plant::kSeparable}) {
    const OnPlant here(plant);
    const auto rig = test::value_of(create_rig({}));
    const std::string name = std::string("plant_") + sim::name_of(plant);
    const auto& all = rig->info().uncertain;
    EXPECT_TRUE(std::any_of(all.begin(), all.end(), [&](const auto& p) { return p.name == name; })) << name;
  }
}

struct Row {
  double force_n, indentation_mm;
};

std::vector<Row> recorded(const std::filesystem::path& file) {
  std::vector<Row> rows;
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  while (std::getline(stream, line)) {
    double time_s = 0.0;
    Row row{};
    if (std::sscanf(line.c_str(), "%lf,%lf,%lf", &time_s, &row.force_n, &row.indentation_mm) == 3) {
      rows.push_back(row);
    }
  }
  return rows;
}

/// Ratio of the rms of what is left to the rms of the force, over all cycles; each file's stiffness is its
/// own.
double left_on_silicone(const sim::GeneralMaterialParameters& memory, const std::filesystem::path& folder) {
  constexpr double kStepS = 0.1, kOffsetMm = 0.4, kApproachMmPerS = 0.167;
  sim::MaterialParameters shape;
  shape.stiffness_at_4n_n_per_mm = 0.2;
  shape.linear = 0.36;
  shape.quadratic = 0.64;
  const sim::GeneralMaterial law(shape, memory, kStepS);
  double sum = 0.0;
  int files = 0;
  for (const int cycle : {3, 4, 6, 7, 8, 9, 10}) {
    sim::GeneralMaterial silicone = law;
    const int approach = static_cast<int>(kOffsetMm / (kApproachMmPerS * kStepS));
    for (int i = 1; i <= approach; ++i) silicone.advance(kOffsetMm * i / approach, 0.0);
    double both = 0.0, ours = 0.0, theirs = 0.0;
    for (const Row& row : recorded(folder / ("cycle_" + std::to_string(cycle) + ".csv"))) {
      const double force_n = silicone.advance(std::max(1e-6, row.indentation_mm + kOffsetMm), 0.0).force_n;
      both += force_n * row.force_n;
      ours += force_n * force_n;
      theirs += row.force_n * row.force_n;
    }
    if (theirs == 0.0) continue;
    ++files;
    sum += 1.0 - both * both / (ours * theirs);  // what the best scale leaves
  }
  EXPECT_EQ(files, 7);
  return std::sqrt(sum / files);
}

TEST(GeneralLawOnSilicone, ThePowerLawExplainsWhatWasRecorded) {
  const auto recordings = recordings_folder();
  if (!recordings) GTEST_SKIP() << "NO RECORDINGS: " << no_recordings_reason();
  const auto folder = *recordings / "silicone_indentation";
  sim::GeneralMaterialParameters memory;
  memory.fading_share = 0.82;
  memory.power = 0.27;
  memory.strain_growth = 3.7;
  EXPECT_LT(left_on_silicone(memory, folder), 0.045);
  sim::GeneralMaterialParameters elastic = memory;
  elastic.fading_share = 0.0;
  EXPECT_GT(left_on_silicone(elastic, folder), 0.09) << "without memory most of it is lost";
  sim::GeneralMaterialParameters slow = memory;
  slow.power = 0.1;
  EXPECT_GT(left_on_silicone(slow, folder), 1.5 * left_on_silicone(memory, folder))
      << "and the power matters";
}

}  // namespace
}  // namespace hapticd::study
