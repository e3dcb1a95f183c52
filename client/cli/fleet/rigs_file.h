#pragma once

#include <string>
#include <vector>

namespace hapticd::cli {

/// One rig of rigs.toml.
struct ListedRig {
  std::string name;
  std::string server;        ///< as --server takes it
  std::string certificates;  ///< as --certificates takes it; empty: where the library looks
  std::string note;          ///< for people, e.g. the room
};

/// $HAPTICD_RIGS, else $XDG_CONFIG_HOME/hapticd/rigs.toml, else ~/.config/hapticd/rigs.toml.
std::string rigs_file_path();

/// Reads the rigs of a file, in the order of their names. Throws LocalError: no such file, unknown keys, no
/// server.
std::vector<ListedRig> read_rigs(const std::string& path);
/// Parses rigs from text; `source` names it in errors.
std::vector<ListedRig> parse_rigs(const std::string& text, const std::string& source);

/// Rigs that "a,b" names, in that order; "all" is all of them. Throws LocalError on a name that is not there.
std::vector<ListedRig> choose_rigs(const std::vector<ListedRig>& rigs, const std::string& names,
                                   const std::string& source);

}  // namespace hapticd::cli
