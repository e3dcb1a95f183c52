#include <chrono>
#include <mutex>
#include <thread>

#include "client/cpp/client.h"
#include "client/cpp/clock/clock_sync.h"
#include "tests/measure/bench/live/daemon_process.h"
#include "tests/measure/bench/live/processor_time.h"
#include "tests/measure/bench/pose/pose_figures.h"
#include "tests/measure/report/child_process.h"
#include "tests/measure/report/quantile.h"

namespace hapticd::bench {
namespace {

using PoseClock = std::chrono::steady_clock;
constexpr std::chrono::seconds kPosePatience{60};

}  // namespace

PoseTally read_poses(const std::string& address, double rate_hz, double seconds, int streams) {
  PoseTally tally;
  std::mutex mutex;
  std::vector<std::thread> readers;
  for (int i = 0; i < streams; ++i) {
    readers.emplace_back([&] {
      client::Client client({.address = address, .timeout = kPosePatience});
      v1::SubscribePosesRequest request;
      request.set_rate_hz(rate_hz);
      client::PoseStream stream = client.subscribe_poses(request);
      v1::Pose pose;
      PoseTally own;
      const auto from = PoseClock::now() + std::chrono::milliseconds(500);  // of settling
      const auto to = from + std::chrono::duration<double>(seconds);
      while (PoseClock::now() < to) {
        if (stream.next(pose, std::chrono::milliseconds(100)) != client::PoseStream::Event::kMessage)
          continue;
        const std::int64_t now_ns = client::ClockSync::now_ns();
        if (PoseClock::now() < from) continue;
        own.age_ms.push_back(1e-6 * static_cast<double>(now_ns - pose.time().daemon_ns()));
      }
      own.skipped = pose.skipped();
      const std::lock_guard lock(mutex);
      tally.age_ms.insert(tally.age_ms.end(), own.age_ms.begin(), own.age_ms.end());
      tally.skipped += own.skipped;
    });
  }
  for (std::thread& reader : readers) reader.join();
  return tally;
}

void add_pose_ages(const std::filesystem::path& logs, bool quick, const AddFigure& add) {
  const double seconds = quick ? 3.0 : 30.0;
  for (const auto& [rate_hz, streams] : {std::pair{120.0, 1}, std::pair{1000.0, 1}, std::pair{120.0, 16}}) {
    const DaemonProcess daemon(logs / "hapticd_pose_age.log");
    const PoseTally tally = read_poses(daemon.address(), rate_hz, seconds, streams);
    for (const double share : {0.5, 0.99, 0.999}) {
      report::Figure figure{"pose_age_ms",
                            {{"rate_hz", rate_hz}, {"subscribers", streams}, {"quantile", share}}};
      figure.unit = "ms";
      if (share == 0.99) figure.goal = 2.0;
      if (tally.age_ms.empty()) {
        figure.failed = "no pose came";
      } else {
        figure.value = report::quantile(tally.age_ms, share);
      }
      add(figure);
    }
  }
}

void add_pose_cpu(const std::filesystem::path& logs, bool quick, const AddFigure& add) {
  constexpr int kStreams = 16;
  const double seconds = quick ? 5.0 : 30.0;
  const DaemonProcess daemon(logs / "hapticd_pose_cpu.log");
  const auto share_while = [&](const std::string& thread, const std::function<void()>& work) {
    const auto from = PoseClock::now();
    const double before = processor_s(daemon.pid(), thread);
    work();
    const double passed = std::chrono::duration<double>(PoseClock::now() - from).count();
    return (processor_s(daemon.pid(), thread) - before) / passed;
  };
  std::this_thread::sleep_for(std::chrono::seconds(1));
  const double alone =
      share_while({}, [&] { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); });
  // Readers are a separate process: only the daemon's share counts.
  report::ChildProcess readers({{(program_folder() / "hapticd_bench").string(), "pose-child", "--server",
                                 daemon.address(), "--seconds", std::to_string(seconds + 4.0)}});
  std::this_thread::sleep_for(std::chrono::seconds(2));
  double thread_share = 0.0;
  const double with = share_while({}, [&] {
    thread_share = share_while("hapticd-poses",
                               [&] { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); });
  });
  readers.wait(std::chrono::seconds(60));
  for (const auto& [part, value] : {std::pair{"whole daemon, compared with no subscriber", with - alone},
                                    std::pair{"thread that makes and hands out poses", thread_share}}) {
    report::Figure figure{"pose_cpu_share", {{"part", part}, {"subscribers", kStreams}, {"rate_hz", 120.0}}};
    figure.value = value;
    figure.goal = 0.01;
    add(figure);
  }
}

}  // namespace hapticd::bench
