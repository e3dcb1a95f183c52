#include "server/recording/flight/flight_ring.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>

#include "hal/recording/mcap_format.h"

namespace hapticd::server {

namespace {

constexpr std::uint64_t kColumnsOffset = 4096;
constexpr std::uint64_t kColumnsBytes = 64 * 1024;
constexpr std::uint64_t kNotesOffset = kColumnsOffset + kColumnsBytes;
constexpr std::uint64_t kNotesBytes = 256 * 1024;
constexpr std::uint64_t kRowsOffset = kNotesOffset + kNotesBytes;
constexpr std::uint64_t kMaxColumns = 1000;
constexpr std::uint64_t kMaxRows = 10'000'000;
constexpr double kMaxRateHz = 1e6;
constexpr char kRingMagic[8] = {'H', 'A', 'P', 'T', 'R', 'I', 'N', '1'};

}  // namespace

/// The beginning of the file. `written` is changed after the rows are there.
struct FlightRing::Head {
  char magic[8];
  std::uint64_t columns_bytes;
  std::uint64_t column_count;
  std::uint64_t capacity_rows;
  double rate_hz;
  std::uint64_t written;
  ClockAnchor anchor;
};

FlightRing::FlightRing(std::string path, int descriptor) : path_(std::move(path)), descriptor_(descriptor) {}

FlightRing::~FlightRing() {
  close(descriptor_);
}

void FlightRing::remove() {
  unlink(path_.c_str());
}

std::optional<hal::Error> FlightRing::write_at(std::uint64_t offset, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t done = pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) {
      return hal::Error{"the ring of the flight recorder cannot be written", path_, std::strerror(errno), "",
                        "see the disk of [recording] ring_folder"};
    }
    offset += static_cast<std::uint64_t>(done);
    bytes.remove_prefix(static_cast<std::size_t>(done));
  }
  return std::nullopt;
}

bool FlightRing::read_at(std::uint64_t offset, std::uint64_t count, std::string& bytes) const {
  bytes.resize(count);
  std::uint64_t done = 0;
  while (done < count) {
    const ssize_t got =
        pread(descriptor_, bytes.data() + done, count - done, static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    done += static_cast<std::uint64_t>(got);
  }
  return true;
}

bool FlightRing::read_head(Head& head) const {
  std::string bytes;
  if (!read_at(0, sizeof head, bytes)) return false;
  std::memcpy(&head, bytes.data(), sizeof head);
  return std::memcmp(head.magic, kRingMagic, sizeof kRingMagic) == 0 && head.columns_bytes <= kColumnsBytes &&
         head.column_count >= 3 && head.column_count <= kMaxColumns && head.capacity_rows >= 1 &&
         head.capacity_rows <= kMaxRows && head.rate_hz >= 1.0 && head.rate_hz <= kMaxRateHz;
}

hal::Result<std::unique_ptr<FlightRing>> FlightRing::create(const std::string& path,
                                                            const std::vector<recording::Column>& columns,
                                                            std::uint64_t capacity_rows, double rate_hz) {
  const int descriptor = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0640);
  if (descriptor < 0) {
    return hal::Error{"the ring of the flight recorder cannot be made", path, std::strerror(errno),
                      "a folder that hapticd may write to", "see [recording] ring_folder"};
  }
  std::unique_ptr<FlightRing> ring(new FlightRing(path, descriptor));
  if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    return hal::Error::of(hal::ErrorCode::kInUse, "another daemon uses this ring of a flight recorder", path,
                          "", "", "");
  }
  ring->columns_ = columns;
  ring->capacity_rows_ = capacity_rows;
  ring->rate_hz_ = rate_hz;
  const std::uint64_t size = kRowsOffset + capacity_rows * ring->row_bytes();
  const int failed =
      ftruncate(descriptor, 0) != 0 ? errno : posix_fallocate(descriptor, 0, static_cast<off_t>(size));
  if (failed != 0) {
    unlink(path.c_str());
    return hal::Error::of(hal::ErrorCode::kFull, "there is no room for the ring of the flight recorder", path,
                          std::strerror(failed), fmt::format("{:.1f} MB", 1e-6 * static_cast<double>(size)),
                          "make room there, or name another folder: [recording] ring_folder");
  }
  const std::string described = recording::describe(columns);
  if (described.size() > kColumnsBytes) return hal::Error{"there are too many columns", path, "", "", ""};
  Head head{};
  std::memcpy(head.magic, kRingMagic, sizeof kRingMagic);
  head.columns_bytes = described.size();
  head.column_count = columns.size();
  head.capacity_rows = capacity_rows;
  head.rate_hz = rate_hz;
  if (auto error = ring->write_at(kColumnsOffset, described)) return *error;
  if (auto error = ring->write_at(0, {reinterpret_cast<const char*>(&head), sizeof head})) return *error;
  return ring;
}

hal::Result<std::unique_ptr<FlightRing>> FlightRing::open_left(const std::string& path) {
  const int descriptor = open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW);
  if (descriptor < 0)
    return hal::Error::of(hal::ErrorCode::kUnreadable, "the ring cannot be opened", path,
                          std::strerror(errno), "", "");
  std::unique_ptr<FlightRing> ring(new FlightRing(path, descriptor));
  if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    return hal::Error::of(hal::ErrorCode::kInUse, "another daemon uses this ring of a flight recorder", path,
                          "", "", "");
  }
  Head head{};
  std::string described;
  recording::Block block;
  struct stat file {};
  const bool good = ring->read_head(head) && ring->read_at(kColumnsOffset, head.columns_bytes, described) &&
                    recording::read_block(described, block) && block.columns.size() == head.column_count &&
                    fstat(descriptor, &file) == 0 &&
                    static_cast<std::uint64_t>(file.st_size) ==
                        kRowsOffset + head.capacity_rows * head.column_count * recording::kCellBytes;
  if (!good)
    return hal::Error::of(hal::ErrorCode::kDamaged,
                          "the file is damaged, or it is not a ring of a flight recorder", path, "", "", "");
  ring->columns_ = std::move(block.columns);
  ring->capacity_rows_ = head.capacity_rows;
  ring->rate_hz_ = head.rate_hz;
  return ring;
}

std::optional<hal::Error> FlightRing::write(std::string_view rows) {
  const std::uint64_t row = row_bytes();
  std::uint64_t at = written();
  while (!rows.empty()) {
    const std::uint64_t place = at % capacity_rows_;
    const std::uint64_t count = std::min<std::uint64_t>(rows.size() / row, capacity_rows_ - place);
    if (auto error = write_at(kRowsOffset + place * row, rows.substr(0, count * row))) return error;
    rows.remove_prefix(count * row);
    at += count;
  }
  return write_at(offsetof(Head, written), {reinterpret_cast<const char*>(&at), sizeof at});
}

std::uint64_t FlightRing::written() const {
  Head head{};
  return read_head(head) ? head.written : 0;
}

std::optional<hal::Error> FlightRing::set_anchor(const ClockAnchor& anchor) {
  return write_at(offsetof(Head, anchor), {reinterpret_cast<const char*>(&anchor), sizeof anchor});
}

ClockAnchor FlightRing::anchor() const {
  Head head{};
  return read_head(head) ? head.anchor : ClockAnchor{};
}

// Sets the notes: length and checksum, then name and texts of each: a crash may come in the middle of it.
std::optional<hal::Error> FlightRing::set_notes(const Notes& notes) {
  std::string content;
  for (const auto& [name, texts] : notes) {
    std::string one;
    recording::put_text(name, one);
    recording::put_texts(texts, one);
    if (content.size() + one.size() + 8 <= kNotesBytes) content += one;
  }
  std::string bytes;
  recording::put(static_cast<std::uint32_t>(content.size()), bytes);
  recording::put(recording::crc32_of(content), bytes);
  return write_at(kNotesOffset, bytes + content);
}

FlightRing::Notes FlightRing::notes() const {
  std::string bytes;
  if (!read_at(kNotesOffset, kNotesBytes, bytes)) return {};
  recording::ByteReader reader(bytes);
  const auto size = reader.take<std::uint32_t>();
  const auto crc = reader.take<std::uint32_t>();
  const std::string_view content = reader.take_bytes(size);
  if (reader.failed() || crc != recording::crc32_of(content)) return {};
  Notes notes;
  recording::ByteReader inner(content);
  while (!inner.rest().empty() && !inner.failed()) {
    const std::string name(inner.take_text());
    notes[name] = inner.take_texts();
  }
  return notes;
}

bool FlightRing::read(std::uint64_t first, std::uint64_t count, std::string& rows) const {
  const std::uint64_t row = row_bytes();
  rows.clear();
  std::string piece;
  for (std::uint64_t at = first; at < first + count;) {
    const std::uint64_t place = at % capacity_rows_;
    const std::uint64_t now = std::min(first + count - at, capacity_rows_ - place);
    if (!read_at(kRowsOffset + place * row, now * row, piece)) return false;
    rows += piece;
    at += now;
  }
  const std::uint64_t end = written();
  return first + count <= end && first + capacity_rows_ >= end;
}

}  // namespace hapticd::server
