// The tool's state as text, from either message.

#include "client/cli/view/live_state.h"

#include <gtest/gtest.h>

namespace hapticd::cli {
namespace {

/// A scene that uses the sensor, nothing wrong, the tool free.
v1::RigState healthy() {
  v1::RigState state;
  state.mutable_loop()->set_running(true);
  state.set_scene("tap_1d");
  state.set_guard_state(v1::GUARD_STATE_RENDERING);
  state.set_guard_fault(v1::GUARD_FAULT_NONE);
  state.set_bias_serial(2);
  state.set_zero_bound_n(0.25);
  state.mutable_followed_zero_n()->set_x(0.03);
  state.mutable_followed_zero_n()->set_z(-0.04);
  state.set_force_age_ms(0.4);
  state.set_contact_reason(v1::CONTACT_REASON_FREE);
  return state;
}

v1::RigState in_contact(double authority) {
  v1::RigState state = healthy();
  state.set_in_contact(true);
  state.set_contact_reason(v1::CONTACT_REASON_HELD);
  state.set_contact_authority(authority);
  return state;
}

std::string reported(const v1::RigState& state) {
  return words(live_state(state));
}
std::string reported(const v1::TelemetrySample& sample) {
  return words(live_state(sample));
}

TEST(LiveState, FreeAndInContact) {
  EXPECT_EQ(reported(healthy()), "free");
  v1::RigState released = healthy();
  released.set_contact_reason(v1::CONTACT_REASON_BELOW_RELEASE);
  EXPECT_EQ(reported(released), "free");
  EXPECT_EQ(reported(in_contact(1.0)), "in contact");
  EXPECT_EQ(reported(in_contact(0.4)), "in contact, 40 % of the force so far: the object is not certain yet");
  EXPECT_EQ(reported(in_contact(0.999)).substr(0, 16), "in contact, 99 %") << "not all of it";
}

TEST(LiveState, WaitsUntilTheToolIsFree) {
  v1::RigState state = healthy();
  state.set_detection_force_n(0.1234);
  state.set_contact_reason(v1::CONTACT_REASON_AWAITING_FREE);
  EXPECT_EQ(reported(state), "waiting until nothing touches the tool: 0.12 N remain; move it in free air");
  state.set_detection_force_n(-0.003);
  EXPECT_EQ(reported(state), "waiting to see the tool in free air: move it by some millimetres");
  state.set_detection_force_n(0.1234);
  state.set_contact_reason(v1::CONTACT_REASON_WITHDRAWN);
  EXPECT_EQ(reported(state), "what was felt was no object; waiting until 0.12 N are gone");
  state.set_detection_force_n(-0.003);
  EXPECT_EQ(reported(state), "what was felt was no object; nothing is felt any more");
}

TEST(LiveState, AWallWaitsForAPositionNotForAForce) {
  v1::RigState state = healthy();
  state.set_scene("wall");
  state.set_zero_bound_n(0.0);
  state.set_bias_serial(0);
  state.clear_followed_zero_n();
  EXPECT_EQ(reported(state), "free") << "it uses no sensor";
  state.set_contact_reason(v1::CONTACT_REASON_AWAITING_FREE);
  EXPECT_EQ(reported(state), "waiting until the tool is outside the wall");
}

TEST(LiveState, ASensorThatWasNeverBiasedMakesAllElseUncertain) {
  v1::RigState state = in_contact(1.0);
  state.set_bias_serial(0);
  EXPECT_EQ(reported(state), "sensor not biased, so this is not certain: in contact");
}

TEST(LiveState, NoFreshForceIsNeverCalledFree) {
  v1::RigState state = healthy();
  state.set_contact_reason(v1::CONTACT_REASON_UNSPECIFIED);
  state.clear_followed_zero_n();
  state.set_force_age_ms(35.25);
  state.add_faults_present(v1::GUARD_FAULT_SENSOR_STALE);
  EXPECT_EQ(reported(state), "no fresh force: the newest is 35.2 ms old (sensor stale)");
  state.add_faults_present(v1::GUARD_FAULT_SENSOR_LOST);
  EXPECT_EQ(reported(state), "no fresh force: the newest is 35.2 ms old (sensor lost)") << "the worse of two";
  state.set_force_age_ms(9.2e12);
  EXPECT_EQ(reported(state), "no fresh force: none has come (sensor lost)");
  state.clear_faults_present();
  state.add_faults_present(v1::GUARD_FAULT_SENSOR_SATURATED);
  EXPECT_EQ(reported(state), "no usable force: sensor saturated");
  state.clear_faults_present();
  EXPECT_EQ(reported(state), "") << "not known";
}

TEST(LiveState, SaysThatTheGuardHoldsTheForceBack) {
  v1::RigState state = in_contact(1.0);
  state.set_guard_state(v1::GUARD_STATE_LATCHED);
  state.set_guard_fault(v1::GUARD_FAULT_STOPPED);
  EXPECT_EQ(reported(state), "the guard holds the force back: latched, stopped");
  state.set_guard_state(v1::GUARD_STATE_SUSPENDED);
  state.set_guard_fault(v1::GUARD_FAULT_LOOP_GAP);
  EXPECT_EQ(reported(state), "the guard holds the force back: suspended, loop gap");
  state.set_guard_state(v1::GUARD_STATE_RESUMING);
  EXPECT_EQ(reported(state), "in contact");
}

TEST(LiveState, TheMostImportantComesFirst) {
  v1::RigState state = healthy();
  state.set_contact_reason(v1::CONTACT_REASON_AWAITING_FREE);
  state.set_bias_serial(0);
  EXPECT_EQ(reported(state).substr(0, 17), "sensor not biased");
  state.set_guard_state(v1::GUARD_STATE_LATCHED);
  EXPECT_EQ(reported(state).substr(0, 9), "the guard");
  state.add_faults_present(v1::GUARD_FAULT_SENSOR_STALE);
  EXPECT_EQ(reported(state).substr(0, 14), "no fresh force");
  state.clear_scene();
  EXPECT_EQ(reported(state), "no scene");
  state.mutable_loop()->set_running(false);
  EXPECT_EQ(reported(state), "the loop does not run");
}

TEST(LiveState, ATelemetrySampleSaysTheSame) {
  v1::TelemetrySample sample;
  EXPECT_EQ(reported(sample), "no scene");
  sample.set_scene_generation(1);
  EXPECT_EQ(reported(sample), "") << "no group with this was asked for";
  sample.mutable_truth()->set_in_contact(true);
  EXPECT_EQ(reported(sample), "in contact");

  v1::ContactGroup& contact = *sample.mutable_contact();
  contact.set_reason(v1::CONTACT_REASON_FREE);
  EXPECT_EQ(reported(sample), "free");
  contact.set_reason(v1::CONTACT_REASON_AWAITING_FREE);
  contact.set_detection_force_n(0.5);
  EXPECT_EQ(reported(sample), "waiting until nothing touches the tool: 0.50 N remain; move it in free air");
  contact.set_reason(v1::CONTACT_REASON_ABOVE_THRESHOLD);
  contact.set_in_contact(true);
  contact.set_authority(0.0);
  EXPECT_EQ(reported(sample).substr(0, 15), "in contact, 0 %");

  sample.mutable_zero();
  sample.mutable_sample()->set_force_age_ms(12.0);
  EXPECT_EQ(reported(sample).substr(0, 17), "sensor not biased");
  sample.mutable_guard()->set_state(v1::GUARD_STATE_LATCHED);
  sample.mutable_guard()->set_fault(v1::GUARD_FAULT_SENSOR_STALE);
  EXPECT_EQ(reported(sample), "the guard holds the force back: latched, sensor stale");
  sample.mutable_guard()->set_faults_present_bits(1U << (v1::GUARD_FAULT_SENSOR_STALE - 1U));
  EXPECT_EQ(reported(sample), "no fresh force: the newest is 12 ms old (sensor stale)");
}

TEST(SensorZeroText, SaysHowFarAndWhatToDo) {
  v1::RigState state = healthy();
  const std::string followed = "followed by 0.050 N of at most 0.25 N since bias 2";
  EXPECT_EQ(sensor_zero_words(state), followed);
  state.add_faults_present(v1::GUARD_FAULT_SENSOR_ZERO_FAR);
  EXPECT_EQ(
      sensor_zero_words(state),
      followed +
          ": far, or it reads something in motion; hapticctl sensor bias, with the tool free and at rest");
  state.add_faults_present(v1::GUARD_FAULT_SENSOR_ZERO_LOST);
  EXPECT_NE(sensor_zero_words(state).find("at the bound"), std::string::npos);
  state.clear_followed_zero_n();
  EXPECT_EQ(sensor_zero_words(state), "not followed while there is no usable force");
  state.set_bias_serial(0);
  EXPECT_EQ(sensor_zero_words(state).substr(0, 10), "not biased");
  state.set_zero_bound_n(0.0);
  EXPECT_EQ(sensor_zero_words(state), "not followed: no scene uses the force sensor");
}

}  // namespace
}  // namespace hapticd::cli
