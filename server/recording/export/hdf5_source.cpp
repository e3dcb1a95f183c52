#include "server/recording/export/hdf5_source.h"

#include <algorithm>
#include <cstring>
#include <string_view>
#include <utility>

namespace hapticd::server {

namespace {

constexpr hsize_t kRowsAtOnce = 4096;
constexpr const char* kGroup = "telemetry";
constexpr std::string_view kScale = "time_s";  ///< the same as time_ns, rounded

hal::Error no_table(const std::string& path, const std::string& why) {
  return hal::Error::of(hal::ErrorCode::kDamaged, "this HDF5 file has no recording of hapticd", path, why, "",
                        "give one that hapticctl record export or hapticd-export wrote");
}

/// Empty if the dataset has no such text.
std::string text_attribute(hid_t dataset, const char* name) {
  if (H5Aexists(dataset, name) <= 0) return {};
  const Hdf5Handle attribute(H5Aopen(dataset, name, H5P_DEFAULT), H5Aclose);
  const Hdf5Handle type(H5Aget_type(attribute.get()), H5Tclose);
  if (!type.good() || H5Tis_variable_str(type.get()) <= 0) return {};
  char* text = nullptr;
  if (H5Aread(attribute.get(), type.get(), &text) < 0 || text == nullptr) return {};
  std::string copy(text);
  H5free_memory(text);
  return copy;
}

/// The names of the datasets of a group, tick and time first.
std::vector<std::string> column_names(hid_t group) {
  std::vector<std::string> names;
  const auto note = [](hid_t, const char* name, const H5L_info_t*, void* all) -> herr_t {
    if (name != kScale) static_cast<std::vector<std::string>*>(all)->emplace_back(name);
    return 0;
  };
  H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, nullptr, note, &names);
  const auto rank = [](const std::string& name) { return name == "tick" ? 0 : name == "time_ns" ? 1 : 2; };
  std::stable_sort(names.begin(), names.end(),
                   [&](const std::string& a, const std::string& b) { return rank(a) < rank(b); });
  return names;
}

}  // namespace

bool Hdf5Source::is_hdf5(const std::string& path) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are returned, not printed
  return H5Fis_hdf5(path.c_str()) > 0;
}

hal::Result<Hdf5Source> Hdf5Source::open(const std::string& path) {
  Hdf5Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!file.good()) return no_table(path, "a file that the library cannot open");
  const Hdf5Handle group(H5Gopen2(file.get(), kGroup, H5P_DEFAULT), H5Gclose);
  if (!group.good()) return no_table(path, "no group 'telemetry'");
  Hdf5Source source(path, std::move(file));
  const std::vector<std::string> names = column_names(group.get());
  if (names.size() < 2 || names[0] != "tick" || names[1] != "time_ns")
    return no_table(path, "no columns 'tick' and 'time_ns'");
  if (names.size() > recording::kMaxColumns) return no_table(path, std::to_string(names.size()) + " columns");
  for (const std::string& name : names) {
    if (auto error = source.add_column(group.get(), name)) return *error;
  }
  return source;
}

std::optional<hal::Error> Hdf5Source::add_column(hid_t group, const std::string& name) {
  Hdf5Handle dataset(H5Dopen2(group, name.c_str(), H5P_DEFAULT), H5Dclose);
  if (!dataset.good()) return no_table(path_, "'" + name + "' is no column");
  const Hdf5Handle space(H5Dget_space(dataset.get()), H5Sclose);
  const Hdf5Handle type(H5Dget_type(dataset.get()), H5Tclose);
  const H5T_class_t kind = H5Tget_class(type.get());
  if (H5Sget_simple_extent_ndims(space.get()) != 1 || (kind != H5T_INTEGER && kind != H5T_FLOAT))
    return no_table(path_, "'" + name + "' is no column of numbers");
  hsize_t rows = 0;
  H5Sget_simple_extent_dims(space.get(), &rows, nullptr);
  if (datasets_.empty()) rows_ = rows;
  if (rows != rows_) return no_table(path_, "columns of different lengths: '" + name + "'");
  columns_.push_back({name, text_attribute(dataset.get(), "unit"), kind == H5T_INTEGER});
  datasets_.push_back(std::move(dataset));
  return std::nullopt;
}

std::optional<hal::Error> Hdf5Source::read(const std::function<bool(const recording::Row&)>& take_row) const {
  const std::size_t row_bytes = columns_.size() * recording::kCellBytes;
  std::vector<char> column(static_cast<std::size_t>(kRowsAtOnce) * recording::kCellBytes);
  std::vector<char> cells(static_cast<std::size_t>(kRowsAtOnce) * row_bytes);
  for (hsize_t first = 0; first < rows_; first += kRowsAtOnce) {
    const hsize_t count = std::min(kRowsAtOnce, rows_ - first);
    const Hdf5Handle memory(H5Screate_simple(1, &count, nullptr), H5Sclose);
    for (std::size_t c = 0; c < columns_.size(); ++c) {
      const Hdf5Handle space(H5Dget_space(datasets_[c].get()), H5Sclose);
      H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, &first, nullptr, &count, nullptr);
      const hid_t type = columns_[c].is_integer ? H5T_NATIVE_INT64 : H5T_NATIVE_DOUBLE;
      if (H5Dread(datasets_[c].get(), type, memory.get(), space.get(), H5P_DEFAULT, column.data()) < 0)
        return no_table(path_, "'" + columns_[c].name + "' cannot be read to its end");
      for (std::size_t row = 0; row < count; ++row) {
        std::memcpy(cells.data() + row * row_bytes + c * recording::kCellBytes,
                    column.data() + row * recording::kCellBytes, recording::kCellBytes);
      }
    }
    for (std::size_t row = 0; row < count; ++row) {
      if (!take_row(recording::Row(cells.data() + row * row_bytes, columns_))) return std::nullopt;
    }
  }
  return std::nullopt;
}

}  // namespace hapticd::server
