#include "client/cli/text/message_json.h"

#include <gtest/gtest.h>

#include <limits>

#include "hapticd/v1/rendering.pb.h"
#include "hapticd/v1/telemetry.pb.h"

namespace hapticd::cli {
namespace {

TEST(MessageJson, WordsForEnumerationsAndBits) {
  v1::TelemetrySample sample;
  sample.set_tick(18446744073709551615U);
  sample.mutable_guard()->set_state(v1::GUARD_STATE_LATCHED);
  sample.mutable_guard()->set_limited_bits(5);
  const Json json = to_json(sample);
  EXPECT_EQ(json["tick"], 18446744073709551615U);
  EXPECT_EQ(json["guard"]["state"], "latched");
  EXPECT_EQ(json["guard"]["limited_bits"], Json({"force", "power"}));
  EXPECT_EQ(json["guard"]["authority"], 0.0);
  EXPECT_FALSE(json.contains("truth"));
}

TEST(MessageJson, AbsentOptionsAreLeftOut) {
  v1::SetTargetRequest request;
  EXPECT_FALSE(to_json(request).contains("ramp_s"));
  request.set_ramp_s(0.0);
  EXPECT_TRUE(to_json(request).contains("ramp_s"));
}

TEST(MessageJson, NumbersThatJsonCannotHoldAreText) {
  v1::FeasibleRange range;
  range.set_max_n_per_mm(std::numeric_limits<double>::infinity());
  range.set_min_n_per_mm(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(to_json(range)["max_n_per_mm"], "Infinity");
  EXPECT_EQ(to_json(range)["min_n_per_mm"], "NaN");
}

}  // namespace
}  // namespace hapticd::cli
