#include "hal/netft/netft_sensor.h"

#include <pthread.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <cmath>
#include <exception>
#include <limits>

#include "hal/nano17_calibration.h"
#include "hal/netft/box_expectation.h"
#include "hal/netft/netft_http.h"
#include "hal/netft/netft_units.h"
#include "hal/netft/rdt_status.h"
#include "hal/shown_text.h"

namespace hapticd::netft {

namespace {

using Clock = std::chrono::steady_clock;

Clock::duration seconds(double value) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(value));
}

hal::SensorInfo info_of(const NetFtConfig& config) {
  hal::SensorInfo info;
  if (const auto calibration = hal::find_nano17_calibration(config.model, "")) {
    info.model = std::string(calibration->model);
    info.range_n = calibration->range_along_n;
    info.resolution_n = calibration->resolution_n;
  }
  info.sample_rate_hz = config.rate_hz;
  info.tool_mass_g = config.tool_mass_g;
  return info;
}

hal::Result<std::string> numeric_address(const std::string& address, const std::string& place) {
  boost::system::error_code code;
  if (!boost::asio::ip::make_address(address, code).is_unspecified() && !code) return address;
  boost::asio::io_context context;
  boost::asio::ip::udp::resolver resolver(context);
  const auto found = resolver.resolve(address, "", code);
  if (!code && !found.empty()) return found.begin()->endpoint().address().to_string();
  return hal::Error{.what = "the address of the box is unknown: " + code.message(),
                    .where = place,
                    .value = address,
                    .limit = {},
                    .remedy = "use the number, e.g. \"192.168.1.1\", or add the name to the name service"};
}

}  // namespace

hal::Result<std::unique_ptr<NetFtSensor>> NetFtSensor::create(const NetFtConfig& config) {
  if (auto error = check(config)) return *error;
  const auto axes = hal::AxisMap::parse(config.axes, "[rig.netft] axes");
  if (!axes) return axes.error();
  return std::unique_ptr<NetFtSensor>(new NetFtSensor(config, *axes));
}

NetFtSensor::NetFtSensor(const NetFtConfig& config, const hal::AxisMap& axes)
    : config_(config),
      axes_(axes),
      info_(info_of(config)),
      stale_after_ns_(std::llround(1e6 * config.stale_after_ms)) {}

NetFtSensor::~NetFtSensor() {
  disengage();
}

std::string NetFtSensor::place() const {
  return "Net F/T box " + config_.address;
}

hal::Error NetFtSensor::not_engaged(const char* what) const {
  return {.what = what,
          .where = place(),
          .value = "not engaged",
          .limit = {},
          .remedy = "engage the sensor first"};
}

std::optional<hal::Error> NetFtSensor::engage() {
  const MutexLock control(control_);
  if (engaged_.load()) return std::nullopt;
  std::optional<hal::Error> error;
  try {
    error = connect(Clock::now() + seconds(config_.connect_timeout_s));
  } catch (const std::exception& failure) {  // of the libraries: out of memory, no more threads
    error = hal::Error{.what = std::string("the system refused: ") + failure.what(),
                       .where = place(),
                       .value = {},
                       .limit = {},
                       .remedy = "check the machine's memory and limits"};
  }
  if (error) {
    checker_ = {};
    stream_.stop();
  }
  const MutexLock reported(reported_);
  refusal_ = error ? error->text() : "";
  return error;
}

hal::Result<BoxConfiguration> NetFtSensor::read_box(Clock::time_point deadline) const {
  const auto page = fetch_page(numeric_address_, config_.http_port, config_.http_path, deadline,
                               kMaxPageBytes, checker_.get_stop_token());
  if (!page) return page.error();
  return parse_netft_configuration(
      *page, "http://" + config_.address + ":" + std::to_string(config_.http_port) + config_.http_path);
}

std::optional<hal::Error> NetFtSensor::connect(Clock::time_point deadline) {
  const auto address = numeric_address(config_.address, place());
  if (!address) return address.error();
  numeric_address_ = *address;

  std::optional<BoxConfiguration> box;
  if (config_.read_configuration) {
    const auto read = read_box(deadline);
    if (!read) return read.error();
    if (auto error = refuse_box(*read, config_)) return error;
    box = *read;
    newtons_per_count_ = box->newtons_per_count;
    newton_millimetres_per_count_ = box->newton_millimetres_per_count;
  } else {
    newtons_per_count_ = *newtons_per(config_.force_unit, "") / config_.counts_per_force;
    newton_millimetres_per_count_ =
        *newton_millimetres_per(config_.torque_unit, "") / config_.counts_per_torque;
  }

  RdtStreamSettings settings;
  settings.address = numeric_address_;
  settings.port = config_.rdt_port;
  settings.newtons_per_count = newtons_per_count_;
  settings.newton_millimetres_per_count = newton_millimetres_per_count_;
  settings.range_counts = ranges_of(config_.model);
  for (std::size_t i = 0; i < 6; ++i) {
    settings.range_counts[i] /= i < 3 ? newtons_per_count_ : newton_millimetres_per_count_;
  }
  const auto milliseconds = [](double value) {
    return std::chrono::nanoseconds(static_cast<std::int64_t>(std::llround(1e6 * value)));
  };
  settings.stale_after = std::chrono::nanoseconds(stale_after_ns_);
  settings.retry_first = milliseconds(config_.retry_first_ms);
  settings.retry_longest = milliseconds(config_.retry_longest_ms);
  settings.fifo_priority = config_.fifo_priority;
  settings.on_box_restart = [this] {
    {
      const MutexLock lock(restart_mutex_);
      restart_seen_ = true;
    }
    restarted_.notify_one();
  };

  // What the page cannot know stays as it was: a bias once lost is lost until another is taken.
  const bool was_lost = zero_ && bias_lost_.load();
  bool page_has_bias = false;
  {
    const MutexLock reported(reported_);
    page_has_bias = box && box->bias && box_bias_;
  }
  bias_lost_.store(!zero_holds(box) || (was_lost && !page_has_bias));
  configuration_changed_.store(false);
  settings.rate_hz = box && box->rdt_rate_hz ? *box->rdt_rate_hz : config_.rate_hz;
  settings.bias_counts = zero_ ? zero_->bias_counts : SixAxes<double>{};
  settings.bias_serial = bias_serial_.load();
  {
    const MutexLock reported(reported_);
    change_.clear();
    if (!zero_) box_bias_ = box ? box->bias : std::nullopt;
    box_ = box;
    connection_ = "udp " + numeric_address_ + ":" + std::to_string(config_.rdt_port);
    if (box && box->rdt_rate_hz) connection_ += ", " + hal::number_text(*box->rdt_rate_hz) + " Hz";
  }
  {
    const MutexLock lock(restart_mutex_);
    restart_seen_ = false;
  }
  if (auto error = stream_.start(settings)) return error;
  checker_ = std::jthread([this](const std::stop_token& stop) { watch_page(stop); });
  if (auto error = await_sample(deadline)) return error;
  {
    const MutexLock reported(reported_);
    shortcoming_ = stream_.shortcoming();
  }
  engaged_.store(true, std::memory_order_release);
  return std::nullopt;
}

std::optional<hal::Error> NetFtSensor::await_sample(Clock::time_point deadline) {
  // Try at least once, even if the page used up all the time.
  const auto last = std::max(deadline, Clock::now() + std::chrono::milliseconds(100));
  RdtTotals totals = stream_.totals();
  while (totals.good == 0 && Clock::now() < last) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    totals = stream_.totals();
  }
  if (totals.good > 0) return std::nullopt;
  hal::Error error{.what = "no sample came from the box",
                   .where = place() + ", udp port " + std::to_string(config_.rdt_port),
                   .value = {},
                   .limit = {},
                   .remedy =
                       "check that no firewall blocks UDP, that no other client takes the stream, and "
                       "the box's status page"};
  if (totals.faulty > 0) {
    error.what = "the box sends, but reports a fault";
    std::string status;
    for (const std::string& line : describe_rdt_status(counters_.recent_status.load())) {
      status += (status.empty() ? "" : "; ") + line;
    }
    error.value = status;
    error.remedy = "correct the reported faults";
  } else if (totals.saturated > 0) {
    error.what = "the box sends, but the sensor is saturated";
    error.remedy = "unload the sensor; if it stays, the transducer is overloaded or its cable is broken";
  } else if (counters_.malformed.load() > 0) {
    error.value = std::to_string(counters_.malformed.load()) + " datagrams that are not RDT records";
  }
  return error;
}

void NetFtSensor::disengage() noexcept {
  const MutexLock control(control_);
  engaged_.store(false, std::memory_order_release);
  checker_ = {};  // asks it to stop and waits
  stream_.stop();
}

void NetFtSensor::read(hal::RigSample& sample) noexcept {
  namespace status = hal::sample_status;
  if (!engaged_.load(std::memory_order_acquire)) {
    mean_.take(sample, monotonic_ns());
    sample.bias_serial = bias_serial_.load(std::memory_order_relaxed);
    sample.status |= status::kForceMissing;
    sample.force_age_ns = std::numeric_limits<std::int64_t>::max();
    last_read_ns_ = 0;
    return;
  }
  const RdtTotals& now = latest_.fetch();
  const std::int64_t now_ns = monotonic_ns();
  if (now.session != seen_.session) {
    seen_ = RdtTotals{};
    seen_.session = now.session;
  }

  const std::uint64_t came = now.good - seen_.good;
  std::uint64_t taken = came;
  if (came > 0) {
    SixAxes<double> counts{};
    std::int64_t instant_ns = now.newest_instant_ns;
    // A mean over what would count as stale says nothing about now.
    if (now_ns - last_read_ns_ > stale_after_ns_) {
      taken = 1;
      skipped_.store(skipped_.load(std::memory_order_relaxed) + came - 1, std::memory_order_relaxed);
      for (std::size_t i = 0; i < counts.size(); ++i) counts[i] = static_cast<double>(now.newest_counts[i]);
    } else {
      for (std::size_t i = 0; i < counts.size(); ++i) {
        const auto sum = static_cast<std::int64_t>(now.sum_counts[i] - seen_.sum_counts[i]);
        counts[i] = static_cast<double>(sum) / static_cast<double>(came);
      }
      const auto since_base = static_cast<std::int64_t>(now.sum_since_base_ns - seen_.sum_since_base_ns);
      instant_ns = now.base_ns + since_base / static_cast<std::int64_t>(came);
    }
    const auto load = [&](std::size_t first, double unit) {
      return hal::Vector3{unit * (counts[first] - now.bias_counts[first]),
                          unit * (counts[first + 1] - now.bias_counts[first + 1]),
                          unit * (counts[first + 2] - now.bias_counts[first + 2])};
    };
    mean_.add(axes_.to_tool(load(0, now.newtons_per_count)),
              axes_.to_tool(load(3, now.newton_millimetres_per_count)), instant_ns);
  }
  mean_.take(sample, now_ns);
  sample.bias_serial = now.session == 0 ? bias_serial_.load(std::memory_order_relaxed) : now.bias_serial;
  sample.force_count = static_cast<std::uint32_t>(std::min<std::uint64_t>(taken, UINT32_MAX));

  const auto age = [&](std::int64_t arrival_ns) {
    return arrival_ns == 0 ? std::numeric_limits<std::int64_t>::max()
                           : std::max<std::int64_t>(now_ns - arrival_ns, 0);
  };
  sample.force_age_ns = age(now.newest_good_ns);
  if (age(now.newest_ns) > stale_after_ns_) {
    sample.status |= status::kForceLost;
  }
  if (now.saturated != seen_.saturated) sample.status |= status::kForceSaturated;
  if (now.faulty != seen_.faulty || now.implausible != seen_.implausible ||
      configuration_changed_.load(std::memory_order_relaxed)) {
    sample.status |= status::kForceFault;
  }
  if (now.warned != seen_.warned || bias_lost_.load(std::memory_order_relaxed)) {
    sample.status |= status::kForceWarning;
  }
  seen_ = now;
  last_read_ns_ = now_ns;
}

void NetFtSensor::watch_page(const std::stop_token& stop) {
  pthread_setname_np(pthread_self(), "netft-page");
  const std::stop_callback wake(stop, [this] {
    { const MutexLock lock(restart_mutex_); }  // who is about to wait does so, and is woken
    restarted_.notify_all();
  });
  std::uint64_t silences = counters_.silences.load();
  auto read_at = Clock::now() + kPageInterval;
  while (!stop.stop_requested()) {
    bool has_restarted = false;
    {
      const MutexLock lock(restart_mutex_);
      const auto until = Clock::now() + std::chrono::milliseconds(250);
      while (!restart_seen_ && !stop.stop_requested() && Clock::now() < until)
        restarted_.wait_until(restart_mutex_, until);
      has_restarted = restart_seen_;
      restart_seen_ = false;
    }
    if (stop.stop_requested()) return;
    if (!has_restarted) {
      const bool was_silent = counters_.silences.load() != silences && !counters_.silent.load();
      if (!was_silent && Clock::now() < read_at) continue;
      silences = counters_.silences.load();
      look_for_foreign_bias(stop);
      read_at = Clock::now() + kPageInterval;
      continue;
    }
    biased_by_other_.store(false);
    bias_lost_.store(true);  // until the page is read
    check_restarted_box(stop);
    if (bias_lost_.load() && !stop.stop_requested()) {
      stream_.set_bias_serial(bias_serial_.fetch_add(1) + 1);
    }
  }
}

void NetFtSensor::look_for_foreign_bias(const std::stop_token& stop) {
  if (!config_.read_configuration) return;
  const std::uint32_t commands = bias_commands_.load();
  const auto give_up = Clock::now() + seconds(config_.connect_timeout_s);
  const auto page =
      fetch_page(numeric_address_, config_.http_port, config_.http_path, give_up, kMaxPageBytes, stop);
  if (!page) return;  // a page that does not answer says nothing about the sensor
  const auto box = parse_netft_configuration(*page, place());
  if (!box || !box->bias) return;
  {
    const MutexLock reported(reported_);
    // Read while a bias of ours was under way, it may be that one.
    if (commands % 2 != 0 || commands != bias_commands_.load()) return;
    if (!box_bias_ || *box->bias == *box_bias_ || foreign_bias_ == box->bias) return;
    foreign_bias_ = box->bias;
  }
  biased_by_other_.store(true);
  bias_lost_.store(true);
  stream_.set_bias_serial(bias_serial_.fetch_add(1) + 1);
}

void NetFtSensor::check_restarted_box(const std::stop_token& stop) {
  if (!config_.read_configuration) {
    // A bias of this driver's holds if the box had no bias, which cannot be seen here.
    bias_lost_.store(config_.bias == BiasBy::kBox);
    return;
  }
  // A box answers over HTTP some time after its stream begins: ask more than once.
  const auto give_up = Clock::now() + seconds(config_.connect_timeout_s);
  std::optional<BoxConfiguration> box;
  while (!box && !stop.stop_requested() && Clock::now() < give_up) {
    const auto page =
        fetch_page(numeric_address_, config_.http_port, config_.http_path, give_up, kMaxPageBytes, stop);
    if (page) {
      if (auto read = parse_netft_configuration(*page, place())) box = *read;
    }
    if (!box) {
      const auto until = Clock::now() + std::chrono::milliseconds(100);
      const MutexLock lock(restart_mutex_);
      while (!stop.stop_requested() && restarted_.wait_until(restart_mutex_, until)) {
      }
    }
  }
  if (!box) return;

  const bool same_scale = box->newtons_per_count == newtons_per_count_ &&
                          box->newton_millimetres_per_count == newton_millimetres_per_count_;
  std::string change;
  {
    const MutexLock reported(reported_);
    if (!same_scale) {
      change = "the box restarted with other counts or units: disengage and engage again";
    } else if (const auto refusal = refuse_box(*box, config_)) {
      change = "the box restarted with another configuration: " + refusal->text();
    }
    change_ = change;
    box_ = box;
    const bool bias_holds = box_bias_ && box->bias ? *box_bias_ == *box->bias : config_.bias != BiasBy::kBox;
    bias_lost_.store(!bias_holds);
  }
  configuration_changed_.store(!change.empty());
}

}  // namespace hapticd::netft
