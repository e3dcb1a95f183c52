#include "hal/netft/netft_sensor.h"

#include <algorithm>
#include <asio.hpp>
#include <cmath>
#include <cstdio>
#include <exception>
#include <limits>

#include "hal/nano17_calibration.h"
#include "hal/netft/box_expectation.h"
#include "hal/netft/netft_http.h"
#include "hal/netft/netft_units.h"
#include "hal/netft/number_text.h"
#include "hal/netft/rdt_status.h"

namespace hapticd::netft {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kBiasTime{250};
constexpr std::chrono::milliseconds kBiasTimeout{2000};
constexpr std::chrono::milliseconds kBiasSettling{50};
constexpr int kBiasAttempts = 3;
/// As many samples as arrive in this time at the lowest allowed rate.
constexpr double kMinBiasShare = 0.5;
/// After a bias on the box its readings are zero to within this share of the range.
constexpr double kBiasedShare = 0.005;
constexpr double kNoticeableLoss = 0.01;
constexpr std::int64_t kRecentlyNs = 60'000'000'000;

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

/// Readings at the end of range of each axis, N and N·mm.
SixAxes<double> ranges_of(const std::string& model) {
  SixAxes<double> ranges{};
  if (const auto c = hal::find_nano17_calibration(model, "")) {
    ranges = {c->range_across_n,    c->range_across_n,    c->range_along_n,
              c->range_torque_n_mm, c->range_torque_n_mm, c->range_torque_n_mm};
  }
  return ranges;
}

hal::Result<std::string> numeric_address(const std::string& address, const std::string& place) {
  asio::error_code code;
  if (!asio::ip::make_address(address, code).is_unspecified() && !code) return address;
  asio::io_context context;
  asio::ip::udp::resolver resolver(context);
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
  const std::lock_guard control(control_);
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
  const std::lock_guard reported(reported_);
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
      const std::lock_guard lock(restart_mutex_);
      restart_seen_ = true;
    }
    restarted_.notify_one();
  };

  // What the page cannot know stays as it was: a bias once lost is lost until another is taken.
  const bool was_lost = zero_ && bias_lost_.load();
  bool page_has_bias = false;
  {
    const std::lock_guard reported(reported_);
    page_has_bias = box && box->bias && box_bias_;
  }
  bias_lost_.store(!zero_holds(box) || (was_lost && !page_has_bias));
  configuration_changed_.store(false);
  settings.rate_hz = box && box->rdt_rate_hz ? *box->rdt_rate_hz : config_.rate_hz;
  settings.bias_counts = zero_ ? zero_->bias_counts : SixAxes<double>{};
  settings.bias_serial = bias_serial_.load();
  {
    const std::lock_guard reported(reported_);
    change_.clear();
    if (!zero_) box_bias_ = box ? box->bias : std::nullopt;
    box_ = box;
    connection_ = "udp " + numeric_address_ + ":" + std::to_string(config_.rdt_port);
    if (box && box->rdt_rate_hz) connection_ += ", " + number_text(*box->rdt_rate_hz) + " Hz";
  }
  {
    const std::lock_guard lock(restart_mutex_);
    restart_seen_ = false;
  }
  if (auto error = stream_.start(settings)) return error;
  checker_ = std::jthread([this](const std::stop_token& stop) { check_after_restarts(stop); });
  if (auto error = await_sample(deadline)) return error;
  {
    const std::lock_guard reported(reported_);
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
  const std::lock_guard control(control_);
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

std::optional<hal::Error> NetFtSensor::bias() {
  const std::lock_guard control(control_);
  if (!engaged_.load()) return not_engaged("the bias cannot be taken");
  std::optional<hal::Error> error;
  switch (config_.bias) {
    case BiasBy::kNone:
      return hal::Error{.what = "biasing is switched off",
                        .where = "[rig.netft] bias",
                        .value = "none",
                        .limit = "software, box",
                        .remedy = "choose what subtracts the reading of the unloaded sensor"};
    case BiasBy::kSoftware:
      error = bias_in_software();
      break;
    case BiasBy::kBox:
      error = bias_on_box();
      break;
  }
  if (error) return error;

  // The bias stays valid only while the box keeps these values after a restart.
  std::optional<std::array<double, 6>> box_bias;
  if (config_.read_configuration) {
    if (const auto box = read_box(Clock::now() + std::chrono::seconds(1))) box_bias = box->bias;
  }
  const std::lock_guard reported(reported_);
  box_bias_ = box_bias;
  bias_lost_.store(false);
  return std::nullopt;
}

hal::Result<SixAxes<double>> NetFtSensor::measure_mean() {
  const auto fewest = static_cast<std::uint64_t>(
      std::ceil(kMinBiasShare * config_.lowest_rate_hz * std::chrono::duration<double>(kBiasTime).count()));
  const auto give_up = Clock::now() + kBiasTimeout;
  const RdtTotals before = stream_.totals();
  RdtTotals after = before;
  do {
    std::this_thread::sleep_for(kBiasTime);
    after = stream_.totals();
  } while (after.good - before.good < fewest && Clock::now() < give_up);

  const auto refusal = [this](std::string what, std::string value, std::string limit, std::string remedy) {
    return hal::Error{.what = std::move(what),
                      .where = place(),
                      .value = std::move(value),
                      .limit = std::move(limit),
                      .remedy = std::move(remedy)};
  };
  const std::uint64_t samples = after.good - before.good;
  if (samples < fewest) {
    return refusal("too few samples came for a bias", std::to_string(samples),
                   "at least " + std::to_string(fewest), "check the connection, then bias again");
  }
  if (after.saturated != before.saturated || after.faulty != before.faulty) {
    return refusal("the sensor was saturated or faulty while the bias was taken", "", "",
                   "take the tool out of contact, correct what the box reports, then bias again");
  }
  SixAxes<double> mean{};
  for (std::size_t i = 0; i < mean.size(); ++i) {
    const auto sum = static_cast<std::int64_t>(after.sum_counts[i] - before.sum_counts[i]);
    mean[i] = static_cast<double>(sum) / static_cast<double>(samples);
  }
  return mean;
}

std::optional<hal::Error> NetFtSensor::bias_in_software() {
  const auto mean = measure_mean();
  if (!mean) return mean.error();
  keep_zero(*mean);
  return std::nullopt;
}

void NetFtSensor::keep_zero(const SixAxes<double>& bias_counts) {
  zero_ = Zero{bias_counts, newtons_per_count_, newton_millimetres_per_count_};
  stream_.set_bias(bias_counts, bias_serial_.fetch_add(1) + 1);
}

bool NetFtSensor::zero_holds(const std::optional<BoxConfiguration>& box) {
  if (!zero_) return true;
  const bool same_units = zero_->newtons_per_count == newtons_per_count_ &&
                          zero_->newton_millimetres_per_count == newton_millimetres_per_count_;
  bool same_box_bias = true;  // if the page does not say
  {
    const std::lock_guard reported(reported_);
    if (box && box->bias && box_bias_) same_box_bias = *box->bias == *box_bias_;
  }
  if (same_units && same_box_bias) return true;
  if (!same_units) zero_->bias_counts = {};
  bias_serial_.fetch_add(1);
  return false;
}

std::optional<hal::Error> NetFtSensor::bias_on_box() {
  const SixAxes<double> ranges = ranges_of(config_.model);
  double worst = 0.0;
  // The command is one datagram, which may be lost: the readings show whether it had an effect.
  for (int attempt = 0; attempt < kBiasAttempts; ++attempt) {
    stream_.send(RdtCommand::kSetSoftwareBias);
    std::this_thread::sleep_for(kBiasSettling);
    const auto mean = measure_mean();
    if (!mean) return mean.error();
    worst = 0.0;
    for (std::size_t i = 0; i < 6; ++i) {
      const double unit = i < 3 ? newtons_per_count_ : newton_millimetres_per_count_;
      worst = std::max(worst, std::abs((*mean)[i] * unit) / ranges[i]);
    }
    if (worst < kBiasedShare) {
      keep_zero({});
      return std::nullopt;
    }
  }
  return hal::Error{.what = "the box did not apply the bias: its readings are not zero",
                    .where = place(),
                    .value = number_text(100.0 * worst) + " % of the range",
                    .limit = "below " + number_text(100.0 * kBiasedShare) + " %",
                    .remedy = "keep the tool out of contact and at rest, or set bias = \"software\""};
}

std::optional<hal::Error> NetFtSensor::reset_condition_latch() {
  const std::lock_guard control(control_);
  if (!engaged_.load()) return not_engaged("the condition latch cannot be reset");
  stream_.send(RdtCommand::kResetConditionLatch);
  return std::nullopt;
}

void NetFtSensor::check_after_restarts(const std::stop_token& stop) {
  for (;;) {
    {
      std::unique_lock lock(restart_mutex_);
      if (!restarted_.wait(lock, stop, [this] { return restart_seen_; })) return;
      restart_seen_ = false;
    }
    // Until the page is read.
    bias_lost_.store(true);
    check_restarted_box(stop);
    if (bias_lost_.load() && !stop.stop_requested()) {
      stream_.set_bias_serial(bias_serial_.fetch_add(1) + 1);
    }
  }
}

void NetFtSensor::check_restarted_box(const std::stop_token& stop) {
  if (!config_.read_configuration) {
    // A bias of this driver's holds if no one had biased the box, which cannot be seen here.
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
      std::unique_lock lock(restart_mutex_);
      restarted_.wait_for(lock, stop, std::chrono::milliseconds(100), [] { return false; });
    }
  }
  if (!box) return;

  const bool same_scale = box->newtons_per_count == newtons_per_count_ &&
                          box->newton_millimetres_per_count == newton_millimetres_per_count_;
  std::string change;
  {
    const std::lock_guard reported(reported_);
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

hal::PartReport NetFtSensor::report() const {
  hal::PartReport report;
  report.part = "force sensor";
  report.driver = "netft";
  const bool engaged = engaged_.load(std::memory_order_acquire);
  const std::uint32_t status = counters_.recent_status.load();
  const bool silent = counters_.silent.load();
  std::vector<std::string>& findings = report.findings;
  {
    const std::lock_guard reported(reported_);
    if (engaged) {
      report.connection = connection_;
      if (!change_.empty()) findings.push_back(change_);
      if (box_) {
        const auto more = findings_of(*box_, config_);
        findings.insert(findings.end(), more.begin(), more.end());
        if (box_->low_pass_hz) report.figures.push_back({"low_pass", *box_->low_pass_hz, "Hz"});
        if (box_->rdt_rate_hz) report.figures.push_back({"rate_set", *box_->rdt_rate_hz, "Hz"});
      }
      if (!shortcoming_.empty()) findings.push_back(shortcoming_);
    } else if (!refusal_.empty()) {
      findings.push_back(refusal_);
    }
  }
  if (engaged) {
    const auto described = describe_rdt_status(status);
    findings.insert(findings.end(), described.begin(), described.end());
    if (bias_lost_.load()) {
      findings.emplace_back(
          "the box restarted, and its earlier bias is lost: take the tool out of contact and bias again "
          "(never "
          "automatic: under load it would hide the load)");
    }
    const double rate_set = box_rate_hz();
    const double rate = counters_.rate_hz.load();
    if (silent) {
      findings.emplace_back(
          "no data come from the box: check its power and cable, and that no other client takes the stream");
    } else if (rate > 0.0 && rate_set > 0.0 && rate < 0.9 * rate_set) {
      findings.push_back("only " + number_text(std::round(rate)) + " samples a second arrive of the " +
                         number_text(rate_set) + " the box is set to: check network and load of the machine");
    }
    if (counters_.loss_share.load() > kNoticeableLoss) {
      findings.push_back(
          number_text(std::round(1000.0 * counters_.loss_share.load()) / 10.0) +
          " % of the samples are lost in the network: connect the box directly, check the cable");
    }
    const std::int64_t last_implausible_ns = counters_.last_implausible_ns.load();
    if (last_implausible_ns != 0 && monotonic_ns() - last_implausible_ns < kRecentlyNs) {
      findings.emplace_back(
          "the stream's numbers ran ahead of time or restarted twice within 10 s: the box fails, or another "
          "someone "
          "else sends in its name; give the box its own network");
    }
    const std::int64_t last_silence_ns = counters_.last_silence_ns.load();
    if (!silent && last_silence_ns != 0 && monotonic_ns() - last_silence_ns < kRecentlyNs) {
      findings.push_back("the stream stopped within the last minute (" +
                         std::to_string(counters_.silences.load()) +
                         " times since the start): check the cable; a box serves one client at a time, so "
                         "close any other");
    }
  }

  const bool unfit = configuration_changed_.load() || judge_rdt_status(status).faulty;
  if (!engaged) {
    const std::lock_guard reported(reported_);
    report.state = refusal_.empty() ? hal::PartState::kIdle : hal::PartState::kFaulty;
  } else if (silent) {
    report.state = hal::PartState::kConnecting;
  } else {
    report.state = unfit ? hal::PartState::kFaulty : hal::PartState::kReady;
  }

  const auto add = [&report](const char* name, const std::atomic<std::uint64_t>& value) {
    report.figures.push_back({name, static_cast<double>(value.load()), ""});
  };
  report.figures.push_back({"rate", counters_.rate_hz.load(), "Hz"});
  add("samples", counters_.good);
  add("sequence_gaps", counters_.gaps);
  add("samples_lost", counters_.lost);
  add("duplicates", counters_.duplicates);
  add("overtaken", counters_.old);
  add("out_of_order", counters_.unconfirmed);
  add("box_restarts", counters_.box_restarts);
  add("stream_restarts", counters_.stream_restarts);
  add("implausible_numbers", counters_.implausible);
  add("malformed_datagrams", counters_.malformed);
  add("foreign_datagrams", counters_.foreign);
  add("saturated_samples", counters_.saturated);
  add("samples_with_warning", counters_.warned);
  add("faulty_samples", counters_.faulty);
  add("silences", counters_.silences);
  add("stream_requests", counters_.requests);
  add("send_errors", counters_.send_errors);
  add("exceptions", counters_.exceptions);
  add("samples_skipped", skipped_);
  return report;
}

double NetFtSensor::box_rate_hz() const {
  const std::lock_guard reported(reported_);
  return box_ && box_->rdt_rate_hz ? *box_->rdt_rate_hz : 0.0;
}

}  // namespace hapticd::netft
