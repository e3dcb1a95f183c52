#include "client/cli/plot/recording.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "client/cli/plot/csv_table.h"
#include "client/cli/session/session.h"
#include "client/cli/text/names.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::cli {
namespace {

v1::RigInfo rig() {
  v1::RigInfo info;
  info.set_kind(v1::RIG_KIND_SIMULATED);
  info.set_name("sim:phantom_1_0");
  info.set_loop_rate_hz(1000.0);
  info.set_has_truth(true);
  auto* parameter = info.add_uncertain_parameters();
  parameter->set_name("structural_mode_hz");
  parameter->set_value(100.0);
  parameter->set_unit("Hz");
  parameter->set_source("two\nlines");
  return info;
}

TEST(TelemetryColumns, CarryGroupQuantityComponentAndUnit) {
  const TelemetryColumns columns(groups_of(rig()));
  const auto names = columns.names();
  for (const char* name : {"tick",
                           "time_s",
                           "scene_generation",
                           "sample_tip_position_x_mm",
                           "sample_sensor_torque_z_n_mm",
                           "sample_status_bits",
                           "contact_reaction_force_n",
                           "contact_count",
                           "contact_in_contact",
                           "deformation_displacement_mm",
                           "target_stiffness_n_per_mm",
                           "control_hand_force_n",
                           "guard_device_command_z_n",
                           "guard_state",
                           "timing_wakeup_ns",
                           "truth_hand_force_z_n",
                           "truth_displacement_mm",
                           "truth_normal_z",
                           "truth_undeformed_contact_x_mm",
                           "direction_normal_x",
                           "direction_reaction_y_n",
                           "direction_friction_force_z_n",
                           "direction_sliding_mm_per_s",
                           "fusion_law_displacement_mm",
                           "fusion_displacement_deviation_mm",
                           "passivity_hand_energy_mj",
                           "passivity_damping_n_s_per_mm"}) {
    EXPECT_EQ(std::count(names.begin(), names.end(), name), 1) << name;
  }
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
}

TEST(TelemetryColumns, ARowHasACellForEachColumn) {
  const TelemetryColumns columns(parse_groups("contact,guard,truth"));
  v1::TelemetrySample sample;
  sample.set_tick(42);
  sample.set_time_ns(1'000'000'001);
  sample.mutable_contact()->set_in_contact(true);
  sample.mutable_contact()->set_reason(v1::CONTACT_REASON_HELD);
  sample.mutable_contact()->set_reaction_force_n(1.25);
  sample.mutable_guard()->set_limited_bits(3);
  const std::string row = columns.row(sample);
  EXPECT_TRUE(row.starts_with("42,1.000000001,0,1,held,0,1.25,")) << row;
  EXPECT_NE(row.find(",force+rate,"), std::string::npos) << row;
  EXPECT_TRUE(row.ends_with(",,,")) << row;  // truth is absent
  EXPECT_EQ(static_cast<std::size_t>(std::count(row.begin(), row.end(), ',')), columns.names().size() - 1);
}

TEST(Recording, NamesRigSceneAndMissingSamples) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("recording.csv");
  v1::RigState state;
  state.set_scene("tap_1d");
  state.set_target_stiffness_n_per_mm(0.5);
  const auto origin = origin_lines(rig(), state, 10);
  Recording recording(path, origin, parse_groups("contact"));
  client::StreamAccount account(10);
  for (const std::uint64_t tick : {10U, 20U, 40U}) {
    v1::TelemetrySample sample;
    sample.set_tick(tick);
    sample.mutable_contact()->set_reaction_force_n(0.5);
    recording.add(sample);
    account.add(tick);
  }
  recording.finish(account);

  const std::string text = test::file_text(path);
  for (const char* words : {"# rig: sim:phantom_1_0 (simulated), loop 1000 Hz",
                            "# uncertain: structural_mode_hz = 100 Hz (two\\nlines)",
                            "# scene at the start: tap_1d, target 0.5 N/mm", "# every 10 tick(s)",
                            "# 3 samples, NOT complete: 1 missing in 1 gap(s)"}) {
    EXPECT_NE(text.find(words), std::string::npos) << words;
  }

  const CsvTable table = CsvTable::read(path);
  EXPECT_EQ(table.column("tick"), (std::vector<double>{10, 20, 40}));
  EXPECT_EQ(table.column("contact_reaction_force_n"), (std::vector<double>{0.5, 0.5, 0.5}));
}

TEST(Recording, SaysWhereItCannotWriteAndMakesNoFolder) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("no_folder/recording.csv");
  const LocalError error = test::thrown_by<LocalError>([&] { const Recording recording(path, {}, {}); });
  EXPECT_EQ(error.detail().what(), "cannot write the recording");
  EXPECT_EQ(error.detail().where(), path);
  EXPECT_EQ(error.detail().value(), "No such file or directory");
  EXPECT_FALSE(std::filesystem::exists(folder.path("no_folder")));
}

}  // namespace
}  // namespace hapticd::cli
