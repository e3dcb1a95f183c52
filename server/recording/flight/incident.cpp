#include "server/recording/flight/incident.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "hal/recording/recording_names.h"
#include "proto/text/utc_text.h"
#include "server/recording/recording_output.h"

namespace hapticd::server {

namespace {

using recording::Row;

constexpr std::size_t kTick = 0;
constexpr std::size_t kTime = 1;

/// What was written of the rows so far.
struct Written {
  std::optional<std::int64_t> first_time_ns;
  std::int64_t last_tick = 0;
  std::uint64_t lost_ticks = 0;
  bool has_tick = false;
};

/// Takes out rows that do not follow the one before: pages that did not reach the disk before the power was
/// lost.
void take_in_order(const FlightRing& ring, std::string& rows, Written& written) {
  std::string good;
  good.reserve(rows.size());
  for (std::size_t at = 0; at < rows.size(); at += ring.row_bytes()) {
    const Row row(rows.data() + at, ring.columns());
    const std::int64_t tick = row.integer(kTick);
    if (written.has_tick && tick <= written.last_tick) continue;
    if (written.has_tick) written.lost_ticks += static_cast<std::uint64_t>(tick - written.last_tick - 1);
    if (!written.first_time_ns) written.first_time_ns = row.integer(kTime);
    written.has_tick = true;
    written.last_tick = tick;
    good.append(rows, at, ring.row_bytes());
  }
  rows = std::move(good);
}

}  // namespace

std::optional<hal::Error> write_incident(const Incident& incident, const FlightRing& ring,
                                         const RecordingSources& sources, const FlightRing::Notes& notes,
                                         const std::string& path) {
  const ClockAnchor anchor = ring.anchor();
  recording::Texts start;
  if (const auto found = notes.find(recording::kStartMetadata); found != notes.end()) start = found->second;
  start["name"] = incident.cause;
  start["note"] = incident.words;
  start["cause"] = incident.cause;
  start["cause_tick"] = std::to_string(incident.tick);
  start["cause_time_ns"] = std::to_string(incident.time_ns);
  start["remedy"] = incident.remedy;
  start["started_unix_ns"] = std::to_string(incident.unix_ns);
  start["started"] = text::utc_text(incident.unix_ns, 3);
  start["rate_hz"] = fmt::format("{:g}", ring.rate_hz());
  start.insert_or_assign("decimation", std::to_string(1));
  auto output = RecordingOutput::begin(path, ring.columns(), sources, anchor, start);
  if (!output) return output.error();
  for (const auto& [name, texts] : notes) {
    if (name == recording::kStartMetadata) continue;
    if (auto error = output->add_metadata(name, texts)) return error;
  }
  std::vector<recording::Event> events = incident.events;
  std::ranges::stable_sort(events, {}, &recording::Event::time_ns);
  auto next_event = events.begin();
  const auto add_events_until = [&](std::int64_t time_ns) {
    for (; next_event != events.end() && next_event->time_ns <= time_ns; ++next_event)
      output->add_event(*next_event);
  };

  Written written;
  std::string rows;
  const auto rows_at_once = static_cast<std::uint64_t>(std::max(1.0, 0.5 * ring.rate_hz()));
  for (std::uint64_t done = 0; done < incident.row_count;) {
    const std::uint64_t count = std::min(rows_at_once, incident.row_count - done);
    if (ring.read(incident.first_row + done, count, rows)) {
      take_in_order(ring, rows, written);
      if (!rows.empty()) {
        output->add_rows(rows);
        add_events_until(Row(rows.data() + rows.size() - ring.row_bytes(), ring.columns()).integer(kTime));
      }
    }
    done += count;
    if (auto error = output->close_chunk()) return error;
  }
  add_events_until(std::numeric_limits<std::int64_t>::max());
  const double after_s =
      written.first_time_ns ? 1e-9 * static_cast<double>(incident.time_ns - *written.first_time_ns) : 0.0;
  return output->finish({{"reason", incident.words},
                         {"lost_ticks", std::to_string(written.lost_ticks)},
                         {"cause_after_s", fmt::format("{:.6f}", after_s)}});
}

}  // namespace hapticd::server
