#include "client/cli/fleet/rigs_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "client/cli/session/session.h"
#include "proto/text/toml_library.h"
#include "proto/text/toml_shape.h"

namespace hapticd::cli {

namespace {

constexpr std::size_t kMaxFile = std::size_t{1} << 20U;
constexpr const char* kForm = "[NAME] with server = \"HOST:PORT\", and certificates and note where wanted";

std::string variable(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): no thread changes it
  return value != nullptr ? value : "";
}

std::string place(const std::string& source, const toml::node& node) {
  return fmt::format("{}, line {}", source, node.source().begin.line);
}

std::string names_of(const std::vector<ListedRig>& rigs) {
  std::string list;
  for (const ListedRig& rig : rigs) list += (list.empty() ? "" : ", ") + rig.name;
  return list.empty() ? "none" : list;
}

ListedRig rig_of(const std::string& name, const toml::table& table, const std::string& source) {
  ListedRig rig;
  rig.name = name;
  for (const auto& [key, value] : table) {
    std::string* kept = key == "server"         ? &rig.server
                        : key == "certificates" ? &rig.certificates
                        : key == "note"         ? &rig.note
                                                : nullptr;
    const std::string known(key.str());
    if (kept == nullptr) {
      throw LocalError(fmt::format("unknown key '{}' of rig '{}'", known, name), place(source, value), known,
                       "server, certificates, note", "remove it or write one of those");
    }
    const auto text = value.value<std::string>();
    if (!value.is_string() || text->empty() || text->find('\0') != std::string::npos) {
      throw LocalError(fmt::format("'{}' of rig '{}' is no text", known, name), place(source, value), "",
                       "a text in quotes, without a zero byte", fmt::format("{} = \"...\"", known));
    }
    *kept = *text;
  }
  if (rig.server.empty()) {
    throw LocalError(fmt::format("rig '{}' has no server", name), place(source, table), "", kForm,
                     "add server = \"HOST:PORT\"");
  }
  // "~" is the shell's: the file is read without one.
  if (rig.certificates.starts_with("~/")) rig.certificates = variable("HOME") + rig.certificates.substr(1);
  return rig;
}

}  // namespace

std::string rigs_file_path() {
  if (const std::string file = variable("HAPTICD_RIGS"); !file.empty()) return file;
  const std::string config = variable("XDG_CONFIG_HOME");
  return (config.starts_with('/') ? config : variable("HOME") + "/.config") + "/hapticd/rigs.toml";
}

std::vector<ListedRig> parse_rigs(const std::string& text, const std::string& source) {
  if (auto problem = text::check_toml_shape(text)) {
    throw LocalError(problem->what, fmt::format("{}, line {}", source, problem->line), problem->value,
                     problem->limit, problem->remedy);
  }
  toml::table document;
  try {
    document = toml::parse(text, source);
  } catch (const toml::parse_error& error) {
    throw LocalError("the list of rigs is not TOML: " + std::string(error.description()),
                     fmt::format("{}, line {}", source, error.source().begin.line), "", kForm,
                     "correct the line");
  }
  std::vector<ListedRig> rigs;
  for (const auto& [key, value] : document) {
    const std::string name(key.str());
    if (!value.is_table()) {
      throw LocalError(fmt::format("'{}' is no rig", name), place(source, value), "", kForm,
                       fmt::format("write it below [{}]", name));
    }
    if (name == "all" || name.find(',') != std::string::npos) {
      throw LocalError("a rig cannot have this name", place(source, value), name,
                       "any but 'all', without a comma", "choose another name");
    }
    rigs.push_back(rig_of(name, *value.as_table(), source));
  }
  return rigs;
}

std::vector<ListedRig> read_rigs(const std::string& path) {
  std::string text;
  try {
    text = read_text_file(path, kMaxFile);
  } catch (const LocalError& error) {
    const std::string limit = error.detail().limit();
    throw LocalError(error.detail().what(), path, "", limit.empty() ? kForm : limit,
                     "write it, or name another file in the environment (HAPTICD_RIGS)");
  }
  return parse_rigs(text, path);
}

std::vector<ListedRig> choose_rigs(const std::vector<ListedRig>& rigs, const std::string& names,
                                   const std::string& source) {
  // A stop of no rig would pass for done.
  if (rigs.empty()) throw LocalError("no rig is listed", source, "", kForm, "write the rigs into it");
  if (names == "all") return rigs;
  std::vector<ListedRig> chosen;
  std::istringstream list(names);
  for (std::string name; std::getline(list, name, ',');) {
    const auto found =
        std::find_if(rigs.begin(), rigs.end(), [&name](const ListedRig& rig) { return rig.name == name; });
    if (found == rigs.end()) {
      throw LocalError("no rig has this name", source, name, names_of(rigs) + ", all",
                       "hapticctl rigs lists them");
    }
    chosen.push_back(*found);
  }
  if (chosen.empty()) {
    throw LocalError("--rigs names no rig", source, names, names_of(rigs) + ", all",
                     "hapticctl rigs lists them");
  }
  return chosen;
}

}  // namespace hapticd::cli
