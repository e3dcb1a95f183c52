#include "server/recording/export/hdf5_sink.h"

#include <hdf5.h>
#include <hdf5_hl.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <initializer_list>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "hal/recording/recording_names.h"
#include "server/recording/export/hdf5_handle.h"

namespace hapticd::server {

namespace {

constexpr hsize_t kChunkRows = 4096;
constexpr unsigned kDeflateLevel = 1;
using Handle = Hdf5Handle;

/// Type of a text of any length, UTF-8: readers get a text, not bytes.
Handle text_type() {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.get(), H5T_VARIABLE);
  H5Tset_cset(type.get(), H5T_CSET_UTF8);
  return type;
}

/// Sets one value as an attribute, which replaces one of the same name.
void set_value(hid_t object, const std::string& name, hid_t stored, hid_t given, const void* value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  if (H5Aexists(object, name.c_str()) > 0) H5Adelete(object, name.c_str());
  const Handle attribute(H5Acreate2(object, name.c_str(), stored, space.get(), H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose);
  if (attribute.good()) H5Awrite(attribute.get(), given, value);
}

void set_text(hid_t object, const std::string& name, const std::string& text) {
  const Handle type = text_type();
  const char* begin = text.c_str();
  set_value(object, name, type.get(), type.get(), &begin);
}

/// Adds one value as a dataset.
void add_value(hid_t group, const std::string& name, hid_t stored, hid_t given, const void* value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle dataset(
      H5Dcreate2(group, name.c_str(), stored, space.get(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Dclose);
  if (dataset.good()) H5Dwrite(dataset.get(), given, H5S_ALL, H5S_ALL, H5P_DEFAULT, value);
}

bool ends_with_one_of(std::string_view key, std::initializer_list<std::string_view> endings) {
  return std::any_of(endings.begin(), endings.end(),
                     [key](std::string_view ending) { return key.ends_with(ending); });
}

template <class Number>
std::optional<Number> whole_number(std::string_view text) {
  Number number{};
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool is_whole = failure == std::errc() && end == text.data() + text.size();
  return is_whole ? std::optional(number) : std::nullopt;
}

/// A text of the metadata as what its key says: a number if the key names a unit or counts, else a text.
/// `put` is set_value() or add_value().
template <class Put>
void put_metadata(hid_t object, const std::string& name, std::string_view key, const std::string& text,
                  const Put& put) {
  if (ends_with_one_of(key,
                       {"_ns", "_tick", "_ticks", "_bytes", "rows", "decimation", "rows_lost_at_the_end"})) {
    if (const auto number = whole_number<std::int64_t>(text))
      return put(object, name, H5T_STD_I64LE, H5T_NATIVE_INT64, &*number);
  }
  if (ends_with_one_of(key, {"_s", "_hz"})) {
    if (const auto number = whole_number<double>(text))
      return put(object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &*number);
  }
  const Handle type = text_type();
  const char* begin = text.c_str();
  put(object, name, type.get(), type.get(), &begin);
}

Handle make_group(hid_t file, const char* name) {
  return {H5Gcreate2(file, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose};
}

/// Makes a dataset that grows row by row.
Handle make_growing(hid_t group, const std::string& name, hid_t type) {
  const hsize_t none = 0;
  const hsize_t unlimited = H5S_UNLIMITED;
  const Handle space(H5Screate_simple(1, &none, &unlimited), H5Sclose);
  const Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_chunk(properties.get(), 1, &kChunkRows);
  H5Pset_shuffle(properties.get());
  H5Pset_deflate(properties.get(), kDeflateLevel);
  return {H5Dcreate2(group, name.c_str(), type, space.get(), H5P_DEFAULT, properties.get(), H5P_DEFAULT),
          H5Dclose};
}

/// "sample_tip_position_z_mm" → "group sample: tip position z mm", as the contract groups it.
std::string description_of(const std::string& column) {
  if (column == "tick") return "number of the loop's tick";
  if (column == "time_ns") return "the rig's clock";
  if (column == "scene_generation") return "counts scene loads; 0 = no scene";
  std::string words = column;
  std::replace(words.begin(), words.end(), '_', ' ');
  const std::size_t blank = words.find(' ');
  if (blank == std::string::npos) return words;
  return "group " + words.substr(0, blank) + ": " + words.substr(blank + 1);
}

}  // namespace

struct Hdf5Sink::State {
  explicit State(const std::string& file_path)
      : path(file_path),
        file(H5Fcreate(file_path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose) {}

  enum class Cells : std::uint8_t { kNumbers, kIntegers, kSeconds };
  struct Dataset {
    Handle handle;
    Cells content;
    std::size_t index;    ///< of the cell; kSeconds: of that in ns
    std::string cells{};  ///< not written yet
    hid_t type() const { return content == Cells::kIntegers ? H5T_NATIVE_INT64 : H5T_NATIVE_DOUBLE; }
  };

  /// Error of a failure; the library does not pass on why.
  hal::Error failed() const { return unwritten(path, 0); }

  std::optional<hal::Error> flush() {
    if (buffered == 0) return std::nullopt;
    const hsize_t size = rows + buffered;
    const Handle memory(H5Screate_simple(1, &buffered, nullptr), H5Sclose);
    for (Dataset& dataset : datasets) {
      if (H5Dset_extent(dataset.handle.get(), &size) < 0) return failed();
      const Handle space(H5Dget_space(dataset.handle.get()), H5Sclose);
      H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, &rows, nullptr, &buffered, nullptr);
      if (H5Dwrite(dataset.handle.get(), dataset.type(), memory.get(), space.get(), H5P_DEFAULT,
                   dataset.cells.data()) < 0) {
        return failed();
      }
      dataset.cells.clear();
    }
    rows = size;
    buffered = 0;
    return std::nullopt;
  }

  void write_events();
  template <class Get>
  void write_numbers(hid_t group, const char* name, const char* unit, Get get);
  template <class Get>
  void write_texts(hid_t group, const char* name, Get get);

  std::string path;
  Handle file;
  std::vector<Dataset> datasets;
  std::vector<recording::Event> events;
  struct Metadata {
    std::string name;  ///< in /metadata
    std::string key;
    std::string text;
  };
  std::vector<Metadata> metadata;
  hsize_t rows = 0;
  hsize_t buffered = 0;
};

Hdf5Sink::Hdf5Sink(std::unique_ptr<State> state) : state_(std::move(state)) {}
Hdf5Sink::~Hdf5Sink() = default;

hal::Result<std::unique_ptr<TableSink>> Hdf5Sink::create(const std::string& path,
                                                         std::vector<ExportColumn> columns) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are returned, not printed
  auto state = std::make_unique<State>(path);
  if (!state->file.good()) {
    return hal::Error{"the file cannot be written", path, "", "", "see the rights of its folder"};
  }
  const Handle group = make_group(state->file.get(), "telemetry");
  Handle scale = make_growing(group.get(), "time_s", H5T_IEEE_F64LE);
  set_text(scale.get(), "unit", "s");
  set_text(scale.get(), "description", "the rig's clock; time_ns has it exactly");
  H5DSset_scale(scale.get(), "time_s");
  std::size_t time_index = 0;
  for (const ExportColumn& one : columns) {
    const hid_t type = one.column.is_integer ? H5T_STD_I64LE : H5T_IEEE_F64LE;
    Handle dataset = make_growing(group.get(), one.column.name, type);
    if (!dataset.good()) return state->failed();
    set_text(dataset.get(), "unit", one.column.unit);
    set_text(dataset.get(), "description", description_of(one.column.name));
    H5DSattach_scale(dataset.get(), scale.get(), 0);
    if (one.column.name == "time_ns") {
      time_index = one.index;
    }
    const auto content = one.column.is_integer ? State::Cells::kIntegers : State::Cells::kNumbers;
    state->datasets.push_back({std::move(dataset), content, one.index});
  }
  state->datasets.push_back({std::move(scale), State::Cells::kSeconds, time_index});
  return std::unique_ptr<TableSink>(new Hdf5Sink(std::move(state)));
}

void Hdf5Sink::add_metadata(const std::string& name, const recording::Texts& texts) {
  const bool of_root = name == recording::kStartMetadata || name == recording::kEndMetadata;
  for (const auto& [key, text] : texts) {
    if (of_root) {
      put_metadata(state_->file.get(), name == recording::kEndMetadata ? "end_" + key : key, key, text,
                   set_value);
    } else {
      state_->metadata.push_back({name + "_" + key, key, text});
    }
  }
}

void Hdf5Sink::add_event(const recording::Event& event) {
  state_->events.push_back(event);
}

std::optional<hal::Error> Hdf5Sink::add_row(const recording::Row& row) {
  const auto append = [](auto value, std::string& cells) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    cells.append(bytes, sizeof value);
  };
  for (State::Dataset& dataset : state_->datasets) {
    switch (dataset.content) {
      case State::Cells::kSeconds:
        append(1e-9 * static_cast<double>(row.integer(dataset.index)), dataset.cells);
        break;
      case State::Cells::kIntegers:
        append(row.integer(dataset.index), dataset.cells);
        break;
      case State::Cells::kNumbers:
        append(row.number(dataset.index), dataset.cells);
        break;
    }
  }
  if (++state_->buffered < kChunkRows) return std::nullopt;
  return state_->flush();
}

template <class Get>
void Hdf5Sink::State::write_numbers(hid_t group, const char* name, const char* unit, Get get) {
  std::vector<std::int64_t> numbers;
  for (const recording::Event& event : events) numbers.push_back(get(event));
  const hsize_t count = numbers.size();
  const Handle space(H5Screate_simple(1, &count, nullptr), H5Sclose);
  const Handle dataset(
      H5Dcreate2(group, name, H5T_STD_I64LE, space.get(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Dclose);
  if (!dataset.good()) return;
  if (count > 0) H5Dwrite(dataset.get(), H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data());
  set_text(dataset.get(), "unit", unit);
}

template <class Get>
void Hdf5Sink::State::write_texts(hid_t group, const char* name, Get get) {
  std::vector<std::string> texts;
  for (const recording::Event& event : events) texts.push_back(get(event));
  std::vector<const char*> begins;
  for (const std::string& text : texts) begins.push_back(text.c_str());
  const hsize_t count = begins.size();
  const Handle type = text_type();
  const Handle space(H5Screate_simple(1, &count, nullptr), H5Sclose);
  const Handle dataset(
      H5Dcreate2(group, name, type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Dclose);
  if (dataset.good() && count > 0)
    H5Dwrite(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, begins.data());
}

void Hdf5Sink::State::write_events() {
  using recording::Event;
  const Handle group = make_group(file.get(), "events");
  write_numbers(group.get(), "time_ns", "ns", [](const Event& event) { return event.time_ns; });
  write_numbers(group.get(), "tick", "1",
                [](const Event& event) { return static_cast<std::int64_t>(event.tick); });
  write_numbers(group.get(), "unix_ns", "ns", [](const Event& event) { return event.unix_ns; });
  write_numbers(group.get(), "lost_ticks", "1",
                [](const Event& event) { return static_cast<std::int64_t>(event.lost_ticks); });
  write_texts(group.get(), "kind", [](const Event& event) { return std::string(name_of(event.kind)); });
  write_texts(group.get(), "text", [](const Event& event) { return event.text; });
  write_texts(group.get(), "by", [](const Event& event) { return event.by; });
  const Handle metadata_group = make_group(file.get(), "metadata");
  std::map<std::string, int> seen;
  for (const auto& [name, key, text] : metadata) {
    const int n = ++seen[name];
    put_metadata(metadata_group.get(), n == 1 ? name : name + "_" + std::to_string(n), key, text, add_value);
  }
}

std::optional<hal::Error> Hdf5Sink::finish() {
  if (auto error = state_->flush()) return error;
  state_->write_events();
  state_->datasets.clear();
  if (H5Fflush(state_->file.get(), H5F_SCOPE_GLOBAL) < 0 || !state_->file.reset()) {
    return state_->failed();
  }
  return std::nullopt;
}

}  // namespace hapticd::server
