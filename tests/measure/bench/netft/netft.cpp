// `hapticd_bench netft`: a 1 kHz loop that reads a force sensor behind a Net F/T box which sends 7000 records
// a second from a separate process, over the loopback.

#include <pthread.h>
#include <sched.h>

#include <chrono>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>
#include <thread>

#include "hal/netft/netft_sensor.h"
#include "rt/loop/latency_histogram.h"
#include "tests/emulators/netft/netft_box.h"
#include "tests/measure/bench/benchmark.h"
#include "tests/measure/report/child_process.h"
#include "tests/measure/report/report.h"

namespace hapticd::bench {
namespace {

using report::fixed;

constexpr double kBoxRateHz = 7000.0;
constexpr std::int64_t kPeriodNs = 1'000'000;
constexpr const char* kThreadName = "hapticd-netft";
constexpr std::chrono::seconds kTimeout{20};

struct NetFtRun {
  double samples = 0.0;
  double samples_lost = 0.0;
  double samples_skipped = 0.0;
  double cpu_share = 0.0;
  double rate_hz = 0.0;
  std::uint64_t ticks = 0;
  std::uint64_t ticks_late = 0;
  std::uint64_t ticks_without_sample = 0;
  std::vector<std::string> findings;
  rt::LatencySnapshot age;
  rt::LatencySnapshot read;
};

std::int64_t now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec;
}

/// Time on a processor of the receiving thread so far, from the scheduler's own books.
double receiver_cpu_s() {
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::string name;
    std::getline(std::ifstream(task.path() / "comm"), name);
    if (name != kThreadName) continue;
    double nanoseconds = 0.0;
    if (std::ifstream(task.path() / "schedstat") >> nanoseconds && nanoseconds > 0.0)
      return 1e-9 * nanoseconds;
    throw std::runtime_error("the kernel keeps no books on the time of threads (schedstat)");
  }
  throw std::runtime_error("there is no receiving thread");
}

double figure(const hal::PartReport& report, const std::string& name) {
  for (const hal::PartFigure& figure : report.figures) {
    if (figure.name == name) return figure.value;
  }
  throw std::runtime_error("the sensor reports no figure " + name);
}

/// Box in a separate process.
class BoxProcess {
 public:
  explicit BoxProcess(const std::filesystem::path& log)
      : log_(log),
        process_({.command = {std::filesystem::read_symlink("/proc/self/exe").string(), "netft-child"},
                  .output = log}) {
    const auto deadline = std::chrono::steady_clock::now() + kTimeout;
    while (http_port_ == 0) {
      const auto status = process_.wait(std::chrono::milliseconds(20));
      std::ifstream text(log_);
      std::string words;
      if (!(text >> words >> udp_port_ >> http_port_) || words != "box") http_port_ = 0;
      if (status) throw std::runtime_error("the box ended with status " + std::to_string(*status));
      if (http_port_ == 0 && std::chrono::steady_clock::now() > deadline) {
        throw std::runtime_error("the box did not say where it listens");
      }
    }
  }
  ~BoxProcess() { process_.signal(SIGTERM); }
  BoxProcess(const BoxProcess&) = delete;
  BoxProcess& operator=(const BoxProcess&) = delete;

  int udp_port() const { return udp_port_; }
  int http_port() const { return http_port_; }

 private:
  std::filesystem::path log_;
  report::ChildProcess process_;
  int udp_port_ = 0;
  int http_port_ = 0;
};

/// Takes a priority for this thread and those it makes; without the right to it: as it is.
void take_priority(int priority) {
  sched_param parameter{};
  parameter.sched_priority = priority;
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter);
}

void read_for(netft::NetFtSensor& sensor, double seconds, NetFtRun& run) {
  take_priority(80);
  rt::LatencyHistogram age;
  rt::LatencyHistogram duration;
  hal::RigSample sample;
  sensor.read(sample);
  std::int64_t deadline_ns = now_ns();
  const std::int64_t end_ns = deadline_ns + static_cast<std::int64_t>(1e9 * seconds);
  while (deadline_ns < end_ns) {
    deadline_ns += kPeriodNs;
    const timespec wake{deadline_ns / 1'000'000'000, deadline_ns % 1'000'000'000};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, nullptr);
    const std::int64_t begin_ns = now_ns();
    sensor.read(sample);
    const std::int64_t done_ns = now_ns();
    ++run.ticks;
    if (sample.force_count == 0) ++run.ticks_without_sample;
    age.record(sample.force_age_ns);
    duration.record(done_ns - begin_ns);
    if (done_ns > deadline_ns + kPeriodNs) {
      ++run.ticks_late;
      deadline_ns += (done_ns - deadline_ns) / kPeriodNs * kPeriodNs;
    }
  }
  run.age = age.snapshot();
  run.read = duration.snapshot();
}

NetFtRun run_netft_case(double seconds, const std::filesystem::path& log) {
  const BoxProcess box(log);
  netft::NetFtConfig config;
  config.address = "127.0.0.1";
  config.rdt_port = box.udp_port();
  config.http_port = box.http_port();
  auto sensor = netft::NetFtSensor::create(config);
  if (!sensor) throw std::runtime_error(sensor.error().text());
  if (const auto error = (*sensor)->engage()) throw std::runtime_error(error->text());
  std::this_thread::sleep_for(std::chrono::milliseconds(200));

  NetFtRun run;
  hal::RigSample ignored;
  (*sensor)->read(ignored);  // what came before the loop runs does not count as missed
  const hal::PartReport before = (*sensor)->report();
  const double cpu_before_s = receiver_cpu_s();
  const std::int64_t begin_ns = now_ns();
  std::thread reader([&] { read_for(**sensor, seconds, run); });
  reader.join();
  const double elapsed_s = 1e-9 * static_cast<double>(now_ns() - begin_ns);
  run.cpu_share = (receiver_cpu_s() - cpu_before_s) / elapsed_s;
  const hal::PartReport after = (*sensor)->report();
  const auto grown = [&](const char* name) { return figure(after, name) - figure(before, name); };
  run.samples = grown("samples");
  run.samples_lost = grown("samples_lost");
  run.samples_skipped = grown("samples_skipped");
  run.rate_hz = run.samples / elapsed_s;
  run.findings = after.findings;
  return run;
}

volatile std::sig_atomic_t g_ended = 0;

}  // namespace

int run_netft(const NetFtOptions& options) {
  report::Report report(options.folder);
  const report::Case conditions{{"rate_hz", kBoxRateHz}, {"loop_hz", 1000.0}};
  report::Figure lost{.figure = "samples_lost", .conditions = conditions, .goal = 0.0};
  report::Figure share{.figure = "cpu_share", .conditions = conditions};
  report::Figure median{.figure = "age_median_us", .conditions = conditions, .unit = "us"};
  report::Figure p999{.figure = "age_p999_us", .conditions = conditions, .unit = "us"};
  report::MarkdownTable table({"samples", "rate [Hz]", "lost", "skipped", "CPU share", "age median [µs]",
                               "age 99 % [µs]", "age 99.9 % [µs]", "age max [µs]", "read median [ns]",
                               "ticks", "late", "without a sample"});
  std::string remark =
      "The box sends from a process of its own over the loopback; the loop reads at 1 kHz, SCHED_FIFO 80 "
      "where "
      "that is\ngranted. CPU share is that of the receiving thread, of one core. Age is that of the newest "
      "sample at the tick.\n";
  try {
    report::Report::note("netft, " + fixed(options.seconds, 0) + " s …");
    const NetFtRun run = run_netft_case(options.seconds, report.folder() / "netft_box.txt");
    const auto age_us = [&](double quantile) {
      return 1e-3 * static_cast<double>(run.age.quantile_ns(quantile));
    };
    lost.value = run.samples_lost;
    share.value = run.cpu_share;
    median.value = age_us(0.5);
    p999.value = age_us(0.999);
    table.add_row({fixed(run.samples, 0), fixed(run.rate_hz, 1), fixed(run.samples_lost, 0),
                   fixed(run.samples_skipped, 0), fixed(run.cpu_share, 4), fixed(age_us(0.5), 1),
                   fixed(age_us(0.99), 1), fixed(age_us(0.999), 1),
                   fixed(1e-3 * static_cast<double>(run.age.max_ns), 0),
                   fixed(static_cast<double>(run.read.quantile_ns(0.5)), 0), std::to_string(run.ticks),
                   std::to_string(run.ticks_late), std::to_string(run.ticks_without_sample)});
    for (const std::string& finding : run.findings) remark += "Reported: " + finding + ".\n";
  } catch (const std::exception& error) {
    report::Report::note(error.what());
    for (report::Figure* failed : {&lost, &share, &median, &p999}) failed->failed = error.what();
  }
  for (const report::Figure& one : {lost, share, median, p999}) report.add(one);
  report.add_table("netft", "A force sensor behind a Net F/T box", table, remark);
  return 0;
}

int run_netft_child() {
  std::signal(SIGTERM, [](int) { g_ended = 1; });
  emulators::NetFtBoxSettings settings;
  settings.rate_hz = kBoxRateHz;
  take_priority(85);  // a real box shares no processor with the loop
  emulators::NetFtBox box(settings);
  box.load({0.1, 0.2, 1.0}, {1.0, 2.0, 3.0});
  std::cout << "box " << box.udp_port() << " " << box.http_port() << std::endl;
  while (g_ended == 0) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  return 0;
}

}  // namespace hapticd::bench
