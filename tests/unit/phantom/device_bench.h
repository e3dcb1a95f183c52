#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "hal/phantom/phantom_device.h"
#include "tests/emulators/board/scripted_board.h"
#include "tests/support/eventually.h"
#include "tests/support/part_report.h"

namespace hapticd::test {

/// A device on a scripted board, its time at rest but for tick() and pass_ms().
class DeviceBench {
 public:
  explicit DeviceBench(const phantom::PhantomConfig& config = {},
                       const emulators::ScriptedBoardConfig& board_config = {})
      : board(std::make_shared<emulators::ScriptedBoard>(board_config)) {
    board->freeze_time();
    auto made = phantom::PhantomDevice::create(config, board);
    EXPECT_TRUE(made) << made.error().text();
    if (made) device = std::move(*made);
  }

  void pass_ms(double ms) { board->advance_ns(static_cast<std::int64_t>(1e6 * ms)); }

  hal::RigSample read() {
    hal::RigSample sample;
    device->read(sample);
    return sample;
  }
  /// A millisecond, a read and a write.
  hal::RigSample tick(const hal::Vector3& force_n = {}) {
    pass_ms(1.0);
    const hal::RigSample sample = read();
    device->write({force_n});
    return sample;
  }

  /// Engages and homes it in its reset pose.
  void make_ready() {
    const auto error = device->engage();
    ASSERT_FALSE(error) << error->text();
    board->move_joints({0.0, 0.0, 0.0});
    tick();
    ASSERT_FALSE(device->home());
    for (int k = 0; k < 150; ++k) tick();
    ASSERT_TRUE(device->homed());
    ASSERT_EQ(tick().status, 0U);
  }

  /// Moves the arm there within the speed that is allowed.
  hal::RigSample go_to(const hal::Vector3& tip_mm) {
    hal::RigSample sample = read();
    const hal::Vector3 from = sample.tip_position_mm;
    const hal::Vector3 way = tip_mm - from;
    const int steps = static_cast<int>(std::sqrt(dot(way, way)) / 0.5) + 1;
    for (int k = 1; k <= steps; ++k) {
      board->move_tip(from + way * (static_cast<double>(k) / steps));
      sample = tick();
      EXPECT_EQ(sample.status, 0U);
    }
    return sample;
  }

  /// Turns the joints, slow enough for any tip.
  hal::RigSample turn_to(const std::array<double, 3>& from_rad, const std::array<double, 3>& to_rad) {
    hal::RigSample sample;
    for (int k = 1; k <= 100; ++k) {
      std::array<double, 3> q{};
      for (std::size_t i = 0; i < 3; ++i) q[i] = from_rad[i] + 0.01 * k * (to_rad[i] - from_rad[i]);
      board->move_joints(q);
      sample = tick();
    }
    return sample;
  }

  double figure(const std::string& name) const { return figure_of(device->report(), name); }
  bool finds(const std::string& text) const { return shows(device->report(), text); }
  bool at_zero_volts() const {
    for (const double v : board->output_volts()) {
      if (v != 0.0) return false;
    }
    return true;
  }

  std::shared_ptr<emulators::ScriptedBoard> board;
  std::unique_ptr<phantom::PhantomDevice> device;
};

}  // namespace hapticd::test
