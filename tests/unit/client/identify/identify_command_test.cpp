#include <gtest/gtest.h>

#include <string>

#include "client/cli/commands/commands.h"
#include "client/cli/identify/identify_task.h"
#include "client/cli/identify/identify_upload.h"
#include "tests/support/value_of.h"
#include "tests/unit/client/identify/identify_fake_service.h"

namespace hapticd::cli {
namespace {

using test::IdentifyFakeService;

/// Runs one command line against a fake and returns what the daemon was asked to start.
v1::StartIdentificationRequest started_by(const std::string& line) {
  IdentifyFakeService fake({});
  Session session{.server = fake.address()};
  CLI::App app;
  build_app(app, session);
  testing::internal::CaptureStdout();
  app.parse("identify " + line + " --detach", false);
  const std::string output = testing::internal::GetCapturedStdout();
  EXPECT_NE(output.find("hapticctl identify watch contact-7"), std::string::npos) << output;
  EXPECT_EQ(session.exit_code, ExitCode::kOk);
  EXPECT_EQ(fake.watched(), 0);
  const auto all = fake.started();
  EXPECT_EQ(all.size(), 1U);
  return all.empty() ? v1::StartIdentificationRequest() : all.back();
}

TEST(IdentifyCommand, ContactTakesItsLawMethodAndLimits) {
  const auto request = started_by(
      "contact --object sponge --law creep --method batch --force 4 --displacement 7.5 --speed 40 "
      "--time-limit 30 --adopt");
  EXPECT_EQ(request.object(), "sponge");
  EXPECT_EQ(request.contact().law(), v1::CONTACT_LAW_CREEP);
  EXPECT_EQ(request.contact().method(), v1::CONTACT_METHOD_BATCH);
  EXPECT_EQ(request.contact().force_n(), 4.0);
  EXPECT_EQ(request.contact().displacement_mm(), 7.5);
  EXPECT_EQ(request.contact().speed_mm_per_s(), 40.0);
  EXPECT_EQ(request.time_limit_s(), 30.0);
  EXPECT_TRUE(request.adopt());
}

TEST(IdentifyCommand, OptionsThatAreNotGivenAreLeftToTheDaemon) {
  const auto request = started_by("contact --object sponge");
  EXPECT_EQ(request.contact().law(), v1::CONTACT_LAW_UNSPECIFIED);
  EXPECT_EQ(request.contact().method(), v1::CONTACT_METHOD_UNSPECIFIED);
  EXPECT_FALSE(request.contact().has_force_n());
  EXPECT_FALSE(request.contact().has_displacement_mm());
  EXPECT_FALSE(request.contact().has_speed_mm_per_s());
  EXPECT_FALSE(request.has_time_limit_s());
  EXPECT_FALSE(request.adopt());
  EXPECT_EQ(request.recording(), "");
}

TEST(IdentifyCommand, FrictionTakesTipAndLength) {
  const auto request = started_by("friction --object sponge --tip ball_bearing --length 50");
  EXPECT_EQ(request.friction().tip(), "ball_bearing");
  EXPECT_EQ(request.friction().length_mm(), 50.0);
}

TEST(IdentifyCommand, TheRigsOwnModelsTakeNoObject) {
  EXPECT_TRUE(started_by("structural --constant").structural_stiffness().constant());
  EXPECT_FALSE(started_by("structural").structural_stiffness().constant());
  EXPECT_FALSE(started_by("structural").structural_stiffness().rigid_contact());
  const auto rigid = started_by("structural --rigid --least-object-stiffness 2000").structural_stiffness();
  EXPECT_TRUE(rigid.rigid_contact());
  EXPECT_EQ(rigid.least_object_stiffness_n_per_mm(), 2000.0);
  EXPECT_FALSE(started_by("structural --rigid").structural_stiffness().has_least_object_stiffness_n_per_mm());
  EXPECT_TRUE(started_by("tool").has_tool());
  EXPECT_EQ(started_by("threshold --duration 30").threshold().duration_s(), 30.0);
  EXPECT_EQ(started_by("gains --target 0.5").gains().target_stiffness_n_per_mm(), 0.5);
  EXPECT_EQ(started_by("tool").object(), "");
}

TEST(IdentifyCommand, AnInclusionTakesItsScanAndItsReference) {
  const auto scan = started_by(
      "inclusion --object lump --reference-model phantom@soft --reach 30 --spacing 6 --displacement 13 "
      "--known-depth 25 --tip-radius 8");
  EXPECT_EQ(scan.object(), "lump");
  EXPECT_EQ(scan.inclusion().reference_model(), "phantom@soft");
  EXPECT_EQ(scan.inclusion().reach_mm(), 30.0);
  EXPECT_EQ(scan.inclusion().spacing_mm(), 6.0);
  EXPECT_EQ(scan.inclusion().displacement_mm(), 13.0);
  EXPECT_EQ(scan.inclusion().known_depth_mm(), 25.0);
  EXPECT_EQ(scan.inclusion().tip_radius_mm(), 8.0);
  const auto plain = started_by("inclusion --object lump");
  EXPECT_FALSE(plain.inclusion().has_reach_mm());
  EXPECT_FALSE(plain.inclusion().has_tip_radius_mm());
  EXPECT_EQ(plain.inclusion().reference_recording(), "");
}

TEST(IdentifyCommand, ImpossibleOptionsAreReportedBeforeAnyCall) {
  for (const char* line : {"contact",
                           "contact --object sponge --law dahl",
                           "contact --object sponge --method guess",
                           "contact --object sponge --method double_stage",
                           "contact --object sponge --force 31",
                           "contact --object sponge --speed 0",
                           "contact --object sponge --time-limit 0.5",
                           "contact --object sponge --column force=Fz",
                           "contact --object sponge --detach --svg x.svg",
                           "friction --object sponge",
                           "friction --object sponge --tip needle",
                           "friction --object sponge --tip rod --length 4",
                           "friction --object sponge --tip rod --normal-force 5",
                           "structural --object sponge",
                           "structural --least-object-stiffness 500",
                           "structural --rigid --least-object-stiffness 1",
                           "structural --press-direction 0,0,-1",
                           "structural --column external=lvdt:um",
                           "tool --object sponge",
                           "threshold --duration 4",
                           "gains --target 21",
                           "gains --recording x.csv",
                           "inclusion",
                           "inclusion --object lump --reach 9",
                           "inclusion --object lump --spacing 2",
                           "inclusion --object lump --known-depth 101",
                           "inclusion --object lump --reference-model a --reference-recording b.csv",
                           "",
                           "cancel one two",
                           "list --svg x.svg"}) {
    Session session{.server = "unix:/nonexistent/hapticd.sock"};
    CLI::App app;
    build_app(app, session);
    EXPECT_THROW(app.parse(std::string("identify ") + line, false), CLI::ParseError) << line;
  }
}

TEST(IdentifyCommand, ColumnsCarryUnitAndScale) {
  IdentifyTask task;
  task.recording_path = "/somewhere/cycle 3.csv";
  task.columns = {"force=Fz:mN:-1", "position=depth [mm]", "time=:ms", "normal_force=::2.5"};
  task.normal_force_n = 5.0;
  const auto description = recording_description(task);
  EXPECT_EQ(description.name(), "cycle 3.csv");
  EXPECT_EQ(description.normal_force_n(), 5.0);
  ASSERT_EQ(description.columns_size(), 4);
  const auto& force = description.columns().at("force");
  EXPECT_EQ(force.column(), "Fz");
  EXPECT_EQ(force.unit(), "mN");
  EXPECT_EQ(force.scale(), -1.0);
  EXPECT_EQ(description.columns().at("position").column(), "depth [mm]");
  EXPECT_FALSE(description.columns().at("position").has_scale());
  EXPECT_EQ(description.columns().at("time").column(), "");
  EXPECT_EQ(description.columns().at("time").unit(), "ms");
  EXPECT_EQ(description.columns().at("normal_force").scale(), 2.5);
}

TEST(IdentifyCommand, AMalformedColumnIsReported) {
  for (const char* text : {"Fz", "=Fz", "force=", "force=Fz:N:much", "force=Fz:N:0", "force=Fz:N:1:2",
                           "force=Fz:N:nan", "force=Fz:N:inf", "force=Fz:N:1e999"}) {
    IdentifyTask task;
    task.columns = {text};
    const LocalError error = test::thrown_by<LocalError>([&] { recording_description(task); });
    EXPECT_EQ(error.detail().where(), "--column");
    EXPECT_EQ(error.detail().value(), text);
  }
  IdentifyTask twice;
  twice.columns = {"force=a", "force=b"};
  EXPECT_THROW(recording_description(twice), LocalError);
}

TEST(IdentifyCommand, ARecordingsNameIsTextOfBoundedLength) {
  EXPECT_EQ(recording_name("/data/Würfel.csv"), "Würfel.csv");
  EXPECT_EQ(recording_name("a\xff"
                           "b\x01.csv"),
            "a?b?.csv");
  EXPECT_EQ(recording_name("\xe0\x80\x80.csv"), "???.csv");  // an overlong encoding
  std::string longest;
  for (int i = 0; i < 300; ++i) longest += "ü";
  EXPECT_EQ(recording_name(longest).size(), 400U);  // 200 characters
}

}  // namespace
}  // namespace hapticd::cli
