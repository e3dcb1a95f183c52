#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include "hal/netft/netft_sensor.h"
#include "tests/emulators/netft/netft_box.h"
#include "tests/support/eventually.h"
#include "tests/support/part_report.h"

namespace hapticd::netft {

using test::eventually;

/// A sensor and the box it reads, over real sockets.
struct NetFtBench {
  explicit NetFtBench(const emulators::NetFtBoxSettings& settings = {}) : box(settings) {
    config.address = "127.0.0.1";
    config.rdt_port = box.udp_port();
    config.http_port = box.http_port();
    config.stale_after_ms = 500.0;
    config.retry_first_ms = 20.0;
    config.retry_longest_ms = 100.0;
    config.fifo_priority = 0;
  }

  std::optional<hal::Error> engage() {
    auto made = NetFtSensor::create(config);
    if (!made) return made.error();
    sensor = std::move(*made);
    if (!box_is_fed) return sensor->engage();
    // Until engaged, the box has to be fed from next to.
    std::atomic<bool> engaged{false};
    std::thread feeder([&] {
      while (!engaged.load()) {
        box.feed({}, {});
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    });
    auto error = sensor->engage();
    engaged.store(true);
    feeder.join();
    settle();
    return error;
  }

  /// All that was sent has been taken.
  void settle() {
    double before = -1.0;
    EXPECT_TRUE(eventually([&] {
      const double now = datagrams();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      return std::exchange(before, now) == now;
    }));
    hal::RigSample ignored;
    sensor->read(ignored);
    sensor->read(ignored);
  }

  double figure(const std::string& name) const { return test::figure_of(sensor->report(), name); }
  /// Whatever came, good or bad.
  double datagrams() const {
    return figure("samples") + figure("duplicates") + figure("overtaken") + figure("out_of_order") +
           figure("malformed_datagrams") + figure("foreign_datagrams") + figure("faulty_samples") +
           figure("saturated_samples");
  }
  bool finds(const std::string& words) const { return test::shows(sensor->report(), words); }
  hal::RigSample read() {
    hal::RigSample sample;
    sensor->read(sample);
    return sample;
  }
  /// Feeds one record and waits until the sensor has it.
  void feed(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm = {}) {
    const double before = datagrams();
    box.feed(force_n, torque_n_mm);
    EXPECT_TRUE(eventually([&] { return datagrams() > before; }));
  }

  emulators::NetFtBox box;
  NetFtConfig config;
  std::unique_ptr<NetFtSensor> sensor;
  bool box_is_fed = false;
};

/// Bench with a box that is fed.
struct FedBench : NetFtBench {
  explicit FedBench(emulators::NetFtBoxSettings settings = {}) : NetFtBench(as_fed(settings)) {
    box_is_fed = true;
    // Silence is not a fault if the test makes the pauses.
    config.stale_after_ms = 10'000.0;
  }
  static emulators::NetFtBoxSettings as_fed(emulators::NetFtBoxSettings settings) {
    settings.fed = true;
    return settings;
  }
};

}  // namespace hapticd::netft
