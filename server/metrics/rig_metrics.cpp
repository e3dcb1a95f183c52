#include "server/metrics/rig_metrics.h"

#include <limits>
#include <utility>
#include <vector>

#include "rt/guard/fault_table.h"

namespace hapticd::server {

namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;

constexpr unsigned kFirstBound = 10;  ///< 2^10 ns, 1 µs
constexpr unsigned kLastBound = 25;   ///< 2^25 ns, 34 ms

struct Labelled {
  std::string label;  ///< value of the family's label
  double value = 0.0;
};

class Families {
 public:
  void gauge(const char* name, const char* help, double value) {
    add(name, help, MetricType::Gauge).emplace_back().gauge.value = value;
  }
  void counter(const char* name, const char* help, std::uint64_t value) {
    add(name, help, MetricType::Counter).emplace_back().counter.value = static_cast<double>(value);
  }
  void gauges(const char* name, const char* help, const char* label, const std::vector<Labelled>& values) {
    auto& metrics = add(name, help, MetricType::Gauge);
    for (const Labelled& one : values) {
      ClientMetric& metric = metrics.emplace_back();
      metric.label.push_back({label, one.label});
      metric.gauge.value = one.value;
    }
  }
  void counters(const char* name, const char* help, const char* label, const std::vector<Labelled>& values) {
    auto& metrics = add(name, help, MetricType::Counter);
    for (const Labelled& one : values) {
      ClientMetric& metric = metrics.emplace_back();
      metric.label.push_back({label, one.label});
      metric.counter.value = one.value;
    }
  }
  void part_figures(const char* name, const char* help, const std::vector<hal::PartReport>& parts) {
    auto& metrics = add(name, help, MetricType::Gauge);
    for (const hal::PartReport& part : parts) {
      for (const hal::PartFigure& figure : part.figures) {
        ClientMetric& metric = metrics.emplace_back();
        metric.label = {{"part", part.part}, {"name", figure.name}, {"unit", figure.unit}};
        metric.gauge.value = figure.value;
      }
    }
  }
  void histogram(const char* name, const char* help, const rt::LatencySnapshot& latency);
  void info(const char* name, const char* help, std::vector<ClientMetric::Label> labels) {
    ClientMetric& metric = add(name, help, MetricType::Gauge).emplace_back();
    metric.label = std::move(labels);
    metric.gauge.value = 1.0;
  }

  std::vector<MetricFamily> take() { return std::move(families_); }

 private:
  std::vector<ClientMetric>& add(const char* name, const char* help, MetricType type) {
    MetricFamily& family = families_.emplace_back();
    family.name = name;
    family.help = help;
    family.type = type;
    return family.metric;
  }
  std::vector<MetricFamily> families_;
};

void Families::histogram(const char* name, const char* help, const rt::LatencySnapshot& latency) {
  ClientMetric::Histogram& shown = add(name, help, MetricType::Histogram).emplace_back().histogram;
  shown.sample_count = latency.count;
  shown.sample_sum = latency.mean_ns * static_cast<double>(latency.count) * 1e-9;
  std::size_t next = 0;
  std::uint64_t below = 0;
  for (unsigned power = kFirstBound; power <= kLastBound; ++power) {
    const auto bound_ns = static_cast<std::int64_t>(std::uint64_t{1} << power);
    while (next < rt::LatencySnapshot::kBuckets && rt::LatencySnapshot::upper_edge_ns(next) < bound_ns) {
      below += latency.counts[next++];
    }
    shown.bucket.push_back({below, static_cast<double>(bound_ns) * 1e-9});
  }
  shown.bucket.push_back({latency.count, std::numeric_limits<double>::infinity()});
}

std::vector<Labelled> present_faults(rt::FaultSet present) {
  std::vector<Labelled> faults;
  for (const rt::FaultRule& rule : rt::kFaultTable) {
    faults.push_back({std::string(rule.name), (present & rt::set_of(rule.fault)) != 0 ? 1.0 : 0.0});
  }
  return faults;
}

std::vector<Labelled> latching_fault(const rt::TickRecord& last) {
  std::vector<Labelled> faults;
  const bool latched = last.guard_state == rt::GuardState::kLatched;
  for (const rt::FaultRule& rule : rt::kFaultTable) {
    faults.push_back({std::string(rule.name), latched && last.guard_fault == rule.fault ? 1.0 : 0.0});
  }
  return faults;
}

}  // namespace

std::vector<MetricFamily> metric_families(const RigFigures& figures) {
  const rt::LoopStatistics& loop = figures.loop;
  const rt::TickRecord& last = figures.last;
  Families all;
  all.info("hapticd_info", "Version of the daemon and name of its rig.",
           {{"version", figures.version}, {"rig", figures.rig}});
  all.gauge("hapticd_loop_running", "1 while the loop ticks.", figures.running ? 1.0 : 0.0);
  all.counter("hapticd_loop_ticks_total", "Ticks of the loop.", loop.ticks);
  all.histogram("hapticd_loop_lateness_seconds", "How late ticks began.", loop.wakeup);
  all.histogram("hapticd_loop_computation_seconds", "What the computation of a tick took.", loop.compute);
  all.histogram("hapticd_loop_device_seconds", "What reading and writing the hardware took.", loop.device);
  all.counter("hapticd_loop_periods_missed_total", "Periods without a tick.", loop.periods_missed);
  all.counters("hapticd_loop_overruns_total", "Ticks that ended after the next was due, by cause.", "cause",
               {{"wakeup", static_cast<double>(loop.overruns_by_wakeup)},
                {"computation", static_cast<double>(loop.overruns_by_compute)},
                {"device", static_cast<double>(loop.overruns_by_device)}});
  all.counter("hapticd_loop_clock_losses_total", "How often a device's scheduler was lost.",
              loop.clock_losses);
  all.gauge("hapticd_sensor_age_seconds", "Age of the newest force sample at the last tick.",
            static_cast<double>(last.force_age_ns) * 1e-9);
  all.gauge("hapticd_guard_latched", "1 while there is no force until someone clears.",
            last.guard_state == rt::GuardState::kLatched ? 1.0 : 0.0);
  all.gauges("hapticd_guard_latched_by", "1 for the fault that latched the guard.", "fault",
             latching_fault(last));
  all.gauges("hapticd_fault_present", "1 for faults and warnings that were present at the last tick.",
             "fault", present_faults(last.faults_present));
  all.gauge("hapticd_scene_loaded", "1 while a scene is loaded.", figures.has_scene ? 1.0 : 0.0);
  all.gauge("hapticd_lease_held", "1 while one client controls the rig.", figures.lease_is_held ? 1.0 : 0.0);
  all.part_figures("hapticd_part_figure", "Counts and readings of drivers, such as temperatures of motors.",
                   figures.parts);
  all.gauge("hapticd_telemetry_subscribers", "Subscribers of telemetry.", figures.subscribers);
  all.counter("hapticd_telemetry_records_lost_total", "Records that no subscriber got.",
              figures.records_lost);
  all.gauge("hapticd_recording_running", "1 while a recording runs.", figures.recording ? 1.0 : 0.0);
  all.gauge("hapticd_recording_lost_ticks", "Ticks that are missing in the recording that runs.",
            static_cast<double>(figures.recording_lost_ticks));
  all.gauge("hapticd_flight_recorder_on", "1 while the last 30 s are kept.",
            figures.flight_recorder_on ? 1.0 : 0.0);
  all.counter("hapticd_incidents_total", "Incidents that the flight recorder has written.",
              figures.incidents);
  return all.take();
}

}  // namespace hapticd::server
