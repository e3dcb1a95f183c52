#include "client/cli/text/names.h"

#include <gtest/gtest.h>

#include <sstream>

#include "client/cli/commands/commands.h"
#include "client/cli/session/session.h"
#include "client/cli/text/command_words.h"
#include "hapticd/v1/pose.pb.h"
#include "hapticd/v1/rig.pb.h"
#include "tests/support/value_of.h"

namespace hapticd::cli {
namespace {

TEST(Names, EveryEnumerationHasWords) {
  EXPECT_EQ(word(v1::CONTACT_REASON_ABOVE_THRESHOLD), "above_threshold");
  EXPECT_EQ(word(v1::RIG_KIND_SIMULATED), "simulated");
  EXPECT_EQ(word(v1::FIELD_GROUP_TRUTH), "truth");
}

TEST(Names, AValueFromALaterDaemonIsStillAWord) {
  EXPECT_EQ(word(static_cast<v1::GuardFault>(99)), "unknown_99");
  EXPECT_EQ(bit_words("status_bits", 1U | 8U | 1U << 20U),
            (std::vector<std::string>{"force_missing", "device_fault", "unknown_bit_20"}));
}

TEST(Names, GroupsAreParsedOnce) {
  EXPECT_EQ(parse_groups("Truth,contact,truth"),
            (std::vector{v1::FIELD_GROUP_TRUTH, v1::FIELD_GROUP_CONTACT}));
  EXPECT_TRUE(parse_groups("").empty());
}

TEST(CommandWords, TakeThePlaceOfTheContract) {
  const auto remedy = [](const std::string& text) {
    v1::ErrorDetail detail;
    detail.set_remedy(text);
    return in_command_words(detail).remedy();
  };
  EXPECT_EQ(remedy("load one first (SceneService.LoadScene)"), "load one first (hapticctl scene load NAME)");
  EXPECT_EQ(remedy("SafetyService/Clear, then again"), "hapticctl clear, then again");
  EXPECT_EQ(remedy("take the frame POSE_FRAME_RIG"), "take the frame rig");
  EXPECT_EQ(remedy("HAND_PROGRAM_KIND_REST, PRESENTATION_ROLE, NO_SUCH_VALUE"),
            "rest, PRESENTATION_ROLE, NO_SUCH_VALUE");
  EXPECT_EQ(remedy("SetTargetRequest.stiffness_n_per_mm"), "stiffness_n_per_mm");
  EXPECT_EQ(remedy("UnheardOfService.Call, SCHED_FIFO, [rig.sim]"),
            "UnheardOfService.Call, SCHED_FIFO, [rig.sim]");
}

TEST(CommandWords, NameCommandsThatExist) {
  Session session{.server = "127.0.0.1:50051"};
  CLI::App app;
  build_app(app, session);
  for (const std::string& line : contract_commands()) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    const CLI::App* at = &app;
    while (words >> word && word.front() >= 'a') {
      ASSERT_NO_THROW(at = at->get_subcommand(word)) << line;
    }
  }
}

TEST(Names, AnUnknownGroupIsNamed) {
  const LocalError error = test::thrown_by<LocalError>([&] { parse_groups("contact,force"); });
  EXPECT_EQ(error.detail().value(), "'force'");
  EXPECT_EQ(error.detail().limit(),
            "sample, motion, contact, deformation, target, control, guard, timing, truth, direction, fusion, "
            "passivity, zero, inclusion, friction, transient, angles, assist");
}

}  // namespace
}  // namespace hapticd::cli
