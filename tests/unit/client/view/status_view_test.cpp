#include "client/cli/view/status_view.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/texts.h"

namespace hapticd::cli {
namespace {

const Terminal kSmallTerminal{.live = true, .unicode = true, .width = 80, .height = 24};

v1::RigInfo status_rig() {
  v1::RigInfo info;
  info.set_name("openhaptics + netft");
  info.set_kind(v1::RIG_KIND_HARDWARE);
  info.set_renders_force(true);
  info.set_loop_rate_hz(1000.0);
  info.mutable_device()->set_model("phantom_premium_1_5_with_a_long_name");
  info.mutable_sensor()->set_model("nano17_si_25");
  auto& parameter = *info.add_uncertain_parameters();
  parameter.set_name("structure");
  parameter.set_source("taken from a similar device, within a factor of two");
  return info;
}

/// Everything that is ever shown at once, with long figures.
v1::RigState status_state() {
  v1::RigState now;
  now.set_scene("tap_1d");
  now.set_guard_state(v1::GUARD_STATE_LATCHED);
  now.set_guard_fault(v1::GUARD_FAULT_SENSOR_STALE);
  now.set_contact_reason(v1::CONTACT_REASON_AWAITING_FREE);
  for (const char* name : {"haptic device", "force sensor"}) {
    auto& part = *now.add_parts();
    part.set_part(name);
    part.set_driver("driver");
    part.set_state(v1::PART_STATE_READY);
    part.set_connection("/usr/lib/x86_64-linux-gnu/libHD.so, default device, Stand-in PHANTOM 1.5 0815");
    for (int i = 0; i < 24; ++i) {
      auto& figure = *part.add_figures();
      figure.set_name("figure_number_" + std::to_string(i));
      figure.set_value(7000.25 + i);
    }
  }
  auto& loop = *now.mutable_loop();
  loop.set_running(true);
  loop.set_ticks(123456789);
  loop.set_periods_missed(84123);
  loop.set_overruns_by_wakeup(29000);
  for (auto* summary :
       {loop.mutable_wakeup(), loop.mutable_jitter(), loop.mutable_compute(), loop.mutable_device()}) {
    summary->set_count(1);
    summary->set_max_us(24668.3);
  }
  return now;
}

TEST(StatusView, FitsASmallTerminalWithGuardAndContactInView) {
  const auto lines = status_lines(status_rig(), status_state(), v1::LeaseState(), {}, kSmallTerminal);
  EXPECT_LE(lines.size(), 23U) << "with the prompt below it" << test::joined(lines);
  for (const std::string& line : lines) EXPECT_LE(display_width(line), 80U) << line;
  const std::string all = test::joined(lines);
  EXPECT_NE(all.find("latched: sensor stale; no force until hapticctl clear"), std::string::npos) << all;
  EXPECT_NE(all.find("--parts"), std::string::npos) << "says what else there is\n" << all;
  EXPECT_NE(all.find("--rough (1 figure known only roughly)"), std::string::npos) << all;
}

TEST(StatusView, CountsOfPartsAreBrokenBetweenWords) {
  const auto lines = status_lines(status_rig(), status_state(), v1::LeaseState(),
                                  {.parts = true, .rough = true}, kSmallTerminal);
  const std::string all = test::joined(lines);
  for (const std::string& line : lines) EXPECT_LE(display_width(line), 80U) << line;
  for (int i = 0; i < 24; ++i) {
    EXPECT_NE(all.find("number " + std::to_string(i)), std::string::npos) << i << "\n" << all;
  }
  EXPECT_NE(all.find("known only roughly"), std::string::npos);
  EXPECT_EQ(all.find("more:"), std::string::npos);
}

TEST(StatusView, WithoutATerminalEachFactIsALine) {
  const auto lines =
      status_lines(status_rig(), status_state(), v1::LeaseState(), {.parts = true}, Terminal{});
  EXPECT_TRUE(std::any_of(lines.begin(), lines.end(), [](const std::string& line) {
    return line.find("figure number 0 ") != std::string::npos &&
           line.find("figure number 23 ") != std::string::npos;
  })) << test::joined(lines);
}

TEST(StatusView, NamesALawThatIsNotLinear) {
  v1::RigState now = status_state();
  now.mutable_target_law()->set_linear_n_per_mm(0.5);
  EXPECT_EQ(test::joined(status_lines(status_rig(), now, {}, {}, Terminal{})).find("linear"),
            std::string::npos);
  now.mutable_target_law()->mutable_hunt_crossley()->set_exponent(1.5);
  const std::string all = test::joined(status_lines(status_rig(), now, {}, {}, Terminal{}));
  EXPECT_NE(all.find("N/mm: Hunt-Crossley, K 0, B 0, M 1.5"), std::string::npos) << all;
}

TEST(StatusView, NamesWhoControlsTheRig) {
  v1::LeaseState lease;
  lease.mutable_lease()->set_holder("user:anna");
  lease.mutable_lease()->set_age_s(12.0);
  lease.mutable_lease()->set_purpose("subject 7");
  const auto lines = status_lines(status_rig(), status_state(), lease, {}, Terminal{});
  const auto named = std::find_if(lines.begin(), lines.end(), [](const std::string& line) {
    return line.find("control") != std::string::npos;
  });
  ASSERT_NE(named, lines.end());
  EXPECT_NE(named->find("user:anna controls the rig for 12 s: subject 7"), std::string::npos) << *named;
  EXPECT_EQ(lines.size(), status_lines(status_rig(), status_state(), {}, {}, Terminal{}).size() + 1)
      << "nothing where no one holds it";
}

}  // namespace
}  // namespace hapticd::cli
