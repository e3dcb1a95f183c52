// Recordings of the daemon.

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "hal/recording/recording_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hapticd::recording;
  const int memory = memfd_create("recording", MFD_CLOEXEC);
  if (memory < 0 || write(memory, data, size) != static_cast<ssize_t>(size)) std::abort();
  const auto file = RecordingFile::open("/proc/self/fd/" + std::to_string(memory));
  close(memory);
  if (!file) return file.error().what.empty() ? (std::abort(), 0) : 0;
  std::size_t cells = 0;
  RecordingVisitor visitor;
  visitor.row = [&](const Row& row) {
    for (std::size_t i = 0; i < file->columns().size(); ++i) cells += row.number(i) > 0.0 ? 1 : 0;
    return true;
  };
  visitor.event = [&](const Event& event) {
    cells += event.text.size() + std::string(name_of(event.kind)).size();
  };
  visitor.metadata = [&](const std::string& name, const Texts& texts) {
    cells += name.size() + texts.size();
  };
  const auto end = file->read(visitor);
  if (!end || (end->is_finished && !end->damage.empty() && end->content.end > size)) std::abort();
  static_cast<void>(file->mcap().summary());
  return 0;
}
