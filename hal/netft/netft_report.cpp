#include <cmath>

#include "hal/netft/box_expectation.h"
#include "hal/netft/netft_sensor.h"
#include "hal/netft/rdt_status.h"
#include "hal/shown_text.h"

namespace hapticd::netft {

namespace {

constexpr double kNoticeableLoss = 0.01;
constexpr std::int64_t kRecentlyNs = 60'000'000'000;

}  // namespace

hal::PartReport NetFtSensor::report() const {
  hal::PartReport report;
  report.part = "force sensor";
  report.driver = "netft";
  const bool engaged = engaged_.load(std::memory_order_acquire);
  const std::uint32_t status = counters_.recent_status.load();
  const bool silent = counters_.silent.load();
  std::vector<std::string>& findings = report.findings;
  {
    const MutexLock reported(reported_);
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
    if (biased_by_other_.load()) {
      findings.emplace_back(
          "another client has biased the box: its reading jumped; close that client, take the tool out of "
          "contact and bias again");
    } else if (bias_lost_.load()) {
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
      findings.push_back("only " + hal::number_text(std::round(rate)) + " samples a second arrive of the " +
                         hal::number_text(rate_set) +
                         " the box is set to: check network and load of the machine");
    }
    if (counters_.loss_share.load() > kNoticeableLoss) {
      findings.push_back(
          hal::number_text(std::round(1000.0 * counters_.loss_share.load()) / 10.0) +
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
    const MutexLock reported(reported_);
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
  const MutexLock reported(reported_);
  return box_ && box_->rdt_rate_hz ? *box_->rdt_rate_hz : 0.0;
}

}  // namespace hapticd::netft
