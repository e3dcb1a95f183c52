// What must hold on real recordings, whatever the pipeline's details: checked against the files themselves,
// read here without the replay rig and without rt.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "tests/measure/study/common/recording_set.h"
#include "tests/measure/study/rig/recording_analysis.h"

namespace hapticd::study {
namespace {

constexpr double kThresholdN = 0.015;
constexpr double kTickS = 0.001;

struct Row {
  double time;
  double force;
  double depth;
};

/// The first three columns, in the file's own units.
std::vector<Row> rows_of(const std::string& path) {
  std::vector<Row> rows;
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream cells(line);
    Row row{};
    char comma = 0;
    if (cells >> row.time >> comma >> row.force >> comma >> row.depth) rows.push_back(row);
  }
  return rows;
}

double peak_of(const std::vector<Row>& rows) {
  return std::max_element(rows.begin(), rows.end(),
                          [](const Row& a, const Row& b) { return a.force < b.force; })
      ->force;
}

/// The state at which the force first exceeds `force`, on the straight line between two rows.
std::optional<Row> first_crossing(const std::vector<Row>& rows, double force) {
  for (std::size_t i = 1; i < rows.size(); ++i) {
    if (rows[i].force <= force) continue;
    const double share = (force - rows[i - 1].force) / (rows[i].force - rows[i - 1].force);
    return Row{std::lerp(rows[i - 1].time, rows[i].time, share), force,
               std::lerp(rows[i - 1].depth, rows[i].depth, share)};
  }
  return std::nullopt;
}

class Recordings : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto folder = recordings_folder();
    if (!folder) GTEST_SKIP() << "NO RECORDINGS: " << no_recordings_reason();
    folder_ = *folder;
  }
  std::vector<RecordingEntry> all_of(const std::string& set) const {
    auto entries = recordings_of(folder_, set);
    EXPECT_FALSE(entries.empty()) << "nothing in " << set;
    return entries;
  }

 private:
  std::filesystem::path folder_;
};

RecordingAnalysis analysed(const RecordingEntry& entry, double target_n_per_mm) {
  auto analysis = analyse_recording(entry.config, target_n_per_mm);
  EXPECT_TRUE(analysis) << analysis.error().text();
  return analysis ? *analysis : RecordingAnalysis{};
}

TEST_F(Recordings, ContactIsDeclaredWhereTheFileCrossesTheThreshold) {
  for (const char* set : {"silicone_indentation", "meat_indentation"}) {
    for (const RecordingEntry& entry : all_of(set)) {
      SCOPED_TRACE(entry.name);
      const auto rows = rows_of(entry.config.path);
      const auto touch = first_crossing(rows, kThresholdN);
      ASSERT_TRUE(touch);
      const RecordingAnalysis analysis = analysed(entry, 0.3);
      ASSERT_TRUE(analysis.contact_time_s);
      EXPECT_EQ(analysis.fault, "");
      EXPECT_EQ(analysis.contacts_to_peak, 1);
      EXPECT_NEAR(*analysis.contact_time_s, touch->time, 2 * kTickS);
      EXPECT_LT(analysis.contact_force_n, 0.05 * peak_of(rows)) << "declared in good time";
    }
  }
}

TEST_F(Recordings, SiliconeStiffnessIsThatOfTheFile) {
  int reached = 0;
  for (const RecordingEntry& entry : all_of("silicone_indentation")) {
    SCOPED_TRACE(entry.name);
    const auto rows = rows_of(entry.config.path);
    const RecordingAnalysis analysis = analysed(entry, 0.3);
    const auto touch = first_crossing(rows, kThresholdN);
    const auto at_1_n = first_crossing(rows, 1.0);
    EXPECT_EQ(analysis.loading.has_value(), at_1_n.has_value());
    if (!at_1_n || !analysis.loading) continue;
    ++reached;
    const double secant = 1.0 / (at_1_n->depth - touch->depth);
    EXPECT_NEAR(analysis.loading->secant_stiffness_n_per_mm, secant, 0.01 * secant);
    // Silicone stiffens as it is pressed.
    EXPECT_GT(analysis.loading->local_stiffness_n_per_mm, secant);
    const auto below = first_crossing(rows, 0.9);
    const auto above = first_crossing(rows, 1.1);
    const double slope = 0.2 / (above->depth - below->depth);
    EXPECT_NEAR(analysis.loading->local_stiffness_n_per_mm, slope, 0.03 * slope);
  }
  EXPECT_GE(reached, 3);
}

TEST_F(Recordings, RenderedForceIsWhatTheTargetLacks) {
  for (const char* set : {"silicone_indentation", "meat_indentation"}) {
    for (const RecordingEntry& entry : all_of(set)) {
      for (const double target : {0.3, 0.7}) {
        SCOPED_TRACE(entry.name + " at " + std::to_string(target));
        const RecordingAnalysis analysis = analysed(entry, target);
        if (!analysis.loading) continue;
        // The controller follows within a few ticks; the slowest loading moves 1 mm/s, so 3 mN a tick at
        // most.
        EXPECT_NEAR(analysis.loading->rendered_force_n, 1.0 - target * analysis.loading->displacement_mm,
                    0.01);
      }
    }
  }
}

TEST_F(Recordings, NanoindentationIsTouchedOnceAndNotInTheFreeApproach) {
  for (const RecordingEntry& entry : all_of("nanoindentation")) {
    SCOPED_TRACE(entry.name);
    const auto rows = rows_of(entry.config.path);
    const RecordingAnalysis analysis = analysed(entry, 0.3);
    ASSERT_TRUE(analysis.contact_time_s);
    EXPECT_GT(*analysis.contact_time_s, 10.0) << "ten seconds of free approach";
    const double peak = peak_of(rows);
    const auto five_percent = first_crossing(rows, 0.05 * peak);
    EXPECT_LT(*analysis.contact_time_s, five_percent->time);
    EXPECT_EQ(analysis.contacts_to_peak, 1) << "one touch, one contact";
    EXPECT_FALSE(analysis.loading) << "scaled, the peak is half a newton";
  }
}

TEST(NoRecordings, AreSaidInWords) {
  const char* before = std::getenv("HAPTICD_RECORDINGS");
  const std::string kept = before == nullptr ? "" : before;
  setenv("HAPTICD_RECORDINGS", "/no/such/folder", 1);
  EXPECT_FALSE(recordings_folder());
  EXPECT_EQ(no_recordings_reason(), "HAPTICD_RECORDINGS names no folder with recordings: '/no/such/folder'");
  unsetenv("HAPTICD_RECORDINGS");
  EXPECT_FALSE(recordings_folder());
  EXPECT_EQ(no_recordings_reason(), "HAPTICD_RECORDINGS is not set; it names the folder of the recordings");
  if (before != nullptr) setenv("HAPTICD_RECORDINGS", kept.c_str(), 1);
}

}  // namespace
}  // namespace hapticd::study
