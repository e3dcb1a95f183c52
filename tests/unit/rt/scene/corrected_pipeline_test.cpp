#include "rt/scene/corrected_pipeline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

namespace hapticd::rt {
namespace {

/// Keeps what it is called with.
class SeenByStages final : public Pipeline {
 public:
  struct Seen {
    hal::RigSample sample;
    hal::Quaternion biased_at;
  };
  explicit SeenByStages(Seen& seen) : seen_(seen) {}
  std::uint32_t channels() const noexcept override { return channel::kContact; }
  PipelineOutput evaluate(const hal::RigSample& sample) noexcept override {
    seen_.sample = sample;
    return {.force_n = {1.0, 2.0, 3.0}, .in_contact = true, .wants_force = true, .held_back = 4};
  }
  void fill_record(TickRecord& record) const noexcept override { record.in_contact = true; }
  void applied(const hal::Vector3&) noexcept override {}
  void reset() noexcept override {}
  void biased_at(const hal::Quaternion& orientation) noexcept override { seen_.biased_at = orientation; }
  void set_target(const TargetLaw&, double) noexcept override {}

 private:
  Seen& seen_;
};

/// An arm whose second link is longer, and whose first joint is elsewhere, than the device believes.
ArmCorrection found() {
  ArmCorrection found;
  found.nominal.use = AngleUse::kPose;
  found.nominal.first_link_mm = 140.0;
  found.nominal.second_link_mm = 140.0;
  found.arm = found.nominal;
  found.arm.second_link_mm = 141.0;
  found.arm.joint_offset_rad[0] = 0.01;
  return found;
}

hal::RigSample sample_at(double joint_rad) {
  hal::RigSample sample;
  sample.angles = {.joint_rad = {joint_rad, 0.3, -0.2}, .gimbal_rad = {0.1, 0.2, 0.3}, .known = true};
  const Eigen::Vector3d tip_mm = wrist_mm(found().nominal, sample.angles);
  const Eigen::Quaterniond q = tool_orientation(found().nominal, sample.angles);
  sample.tip_position_mm = {tip_mm.x(), tip_mm.y(), tip_mm.z()};
  sample.tip_orientation = {q.w(), q.x(), q.y(), q.z()};
  sample.sensor_force_n = {0.0, 0.0, 1.5};
  return sample;
}

class CorrectedScene : public testing::Test {
 protected:
  hal::Vector3 tip_mm(const hal::RigSample& sample) {
    TickRecord record;
    record.tip_position_mm = sample.tip_position_mm;
    output = pipeline.evaluate(sample);
    pipeline.fill_record(record);
    EXPECT_TRUE(record.in_contact) << "the record is the stages'";
    EXPECT_EQ(record.tip_position_mm.x, sample.tip_position_mm.x) << "telemetry says what was reported";
    return seen.sample.tip_position_mm;
  }

  SeenByStages::Seen seen;
  CorrectedPipeline pipeline{std::make_unique<SeenByStages>(seen), found()};
  PipelineOutput output;
};

TEST_F(CorrectedScene, StagesSeeTheCorrectedPoseAndTheRestAsItIs) {
  const hal::RigSample sample = sample_at(0.2);
  const CorrectedPose expected = correct(found(), sample);
  const hal::Vector3 tip = tip_mm(sample);
  EXPECT_NEAR(tip.x, expected.tip_mm.x(), 1e-9);
  EXPECT_NEAR(tip.y, expected.tip_mm.y(), 1e-9);
  EXPECT_NEAR(tip.z, expected.tip_mm.z(), 1e-9);
  EXPECT_GT(std::hypot(tip.x - sample.tip_position_mm.x, tip.y - sample.tip_position_mm.y), 1.0);
  EXPECT_NEAR(seen.sample.tip_orientation.w, expected.orientation.w(), 1e-9);
  EXPECT_NEAR(seen.sample.tip_orientation.z, expected.orientation.z(), 1e-9);
  EXPECT_EQ(seen.sample.sensor_force_n.z, 1.5);
  EXPECT_EQ(output.force_n.y, 2.0);
  EXPECT_TRUE(output.in_contact);
  EXPECT_EQ(output.held_back, 4);
  EXPECT_EQ(pipeline.channels(), channel::kContact);
}

TEST_F(CorrectedScene, APoseWithoutAnglesDoesNotJump) {
  hal::RigSample sample = sample_at(0.2);
  const hal::Vector3 before = tip_mm(sample);
  sample.angles.known = false;
  const hal::Vector3 without = tip_mm(sample);
  EXPECT_NEAR(without.x, before.x, 1e-12);
  EXPECT_NEAR(without.z, before.z, 1e-12);
  sample.angles.known = true;
  sample.angles.joint_rad[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NEAR(tip_mm(sample).x, before.x, 1e-12);
}

TEST_F(CorrectedScene, ABiasIsOfTheCorrectedOrientation) {
  const hal::RigSample sample = sample_at(0.2);
  tip_mm(sample);
  pipeline.biased_at(sample.tip_orientation);
  EXPECT_NEAR(seen.biased_at.w, seen.sample.tip_orientation.w, 1e-12);
  EXPECT_NEAR(seen.biased_at.z, seen.sample.tip_orientation.z, 1e-12);
}

TEST_F(CorrectedScene, ABiasOfBeforeTheFirstPoseIsCorrectedWithIt) {
  const hal::RigSample sample = sample_at(0.2);
  pipeline.biased_at(sample.tip_orientation);
  EXPECT_NEAR(seen.biased_at.z, sample.tip_orientation.z, 1e-12);  // nothing better is known yet
  tip_mm(sample);
  const CorrectedPose expected = correct(found(), sample);
  EXPECT_NEAR(seen.biased_at.w, expected.orientation.w(), 1e-9);
  EXPECT_NEAR(seen.biased_at.z, expected.orientation.z(), 1e-9);
  EXPECT_GT(std::abs(seen.biased_at.z - sample.tip_orientation.z), 1e-3);
}

}  // namespace
}  // namespace hapticd::rt
