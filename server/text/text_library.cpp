#include "server/text/text_library.h"

#include <algorithm>
#include <filesystem>

#include "server/text/suggestion.h"
#include "server/text/toml_text.h"

namespace hapticd::server {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMaxName = 64;

bool name_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
}

bool is_name(std::string_view name) {
  return !name.empty() && name.size() <= kMaxName && std::all_of(name.begin(), name.end(), name_character);
}

bool holds(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

std::optional<hal::Error> check_name(std::string_view kind, std::string_view name, std::string_view where) {
  if (is_name(name)) return std::nullopt;
  const bool vowel = std::string_view("aeiou").find(kind.front()) != std::string_view::npos;
  return hal::Error::of(hal::ErrorCode::kMalformed,
                        (vowel ? "not a name for an " : "not a name for a ") + std::string(kind),
                        std::string(where), std::string(name.substr(0, kMaxName)),
                        "1 … 64 of a-z A-Z 0-9 _ -", "choose such a name");
}

std::optional<hal::Error> TextLibrary::check_folder() const {
  std::error_code failure;
  if (folder_.empty() || fs::is_directory(folder_, failure)) return std::nullopt;
  return hal::Error::of(hal::ErrorCode::kUnreadable, "the " + kind_ + " folder cannot be read", folder_,
                        failure ? failure.message() : "not a folder", "", "check path and permissions");
}

std::vector<std::string> TextLibrary::folder_names() const {
  std::vector<std::string> names;
  if (folder_.empty()) return names;
  std::error_code failure;
  for (fs::directory_iterator it(folder_, failure), end; !failure && it != end; it.increment(failure)) {
    std::error_code type;
    const std::string stem = it->path().stem().string();
    if (it->path().extension() == ".toml" && it->is_regular_file(type) && is_name(stem))
      names.push_back(stem);
  }
  return names;
}

std::vector<std::string> TextLibrary::names() const {
  std::vector<std::string> names = folder_names();
  for (const BuiltinText& text : builtin_) names.emplace_back(text.name);
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

bool TextLibrary::contains(const std::string& name) const {
  return holds(names(), name);
}

hal::Result<TextLibrary::Text> TextLibrary::find(const std::string& name) const {
  // Only names found in the folder are opened.
  if (holds(folder_names(), name)) {
    const std::string path = (fs::path(folder_) / (name + ".toml")).string();
    auto toml = read_text_file(path);
    if (!toml) return toml.error();
    return Text{std::move(*toml), path};
  }
  for (const BuiltinText& text : builtin_) {
    if (text.name == name) return Text{std::string(text.toml), "built-in " + kind_ + " '" + name + "'"};
  }
  const std::vector<std::string> known = names();
  return hal::Error::of(hal::ErrorCode::kNotFound, "unknown " + kind_ + " '" + name + "'", kind_ + " name",
                        name, comma_separated(known), did_you_mean(name, known, "use one of those"));
}

}  // namespace hapticd::server
