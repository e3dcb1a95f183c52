#include "server/grpc/recording/event_notes.h"

#include <utility>

#include "server/grpc/recording/call_words.h"
#include "server/grpc/recording/recording_setup.h"
#include "server/process/system_clock.h"

namespace hapticd::server {

void EventNotes::note(recording::EventKind kind, std::string text, const std::string& by) {
  recording::Event event;
  event.time_ns = session_.now_ns();
  event.tick = session_.last_tick();
  event.unix_ns = read_clocks().utc_ns;
  event.kind = kind;
  event.text = std::move(text);
  event.by = by;
  event_log_.add(std::move(event));
}

void EventNotes::note_call(const AuditLine& line) {
  if (line.outcome != "OK" || line.method == "RecordingService/Annotate") return;  // already a separate event
  std::string text = words_of_call(line.method, line.arguments);
  if (line.effective_tick) text += ", in force from tick " + std::to_string(*line.effective_tick);
  note(kind_of_call(line.method), std::move(text), line.identity);
}

}  // namespace hapticd::server
