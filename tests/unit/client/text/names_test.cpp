#include "client/cli/text/names.h"

#include <gtest/gtest.h>

#include "client/cli/session/session.h"
#include "hapticd/v1/rig.pb.h"

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

TEST(Names, AnUnknownGroupIsNamed) {
  try {
    parse_groups("contact,force");
    ADD_FAILURE();
  } catch (const LocalError& error) {
    EXPECT_EQ(error.detail().value(), "'force'");
    EXPECT_EQ(
        error.detail().limit(),
        "sample, motion, contact, deformation, target, control, guard, timing, truth, direction, fusion, "
        "passivity, zero, inclusion, friction, transient, angles, assist");
  }
}

}  // namespace
}  // namespace hapticd::cli
