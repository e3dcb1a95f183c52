#include "client/cli/session/own_program.h"

#include <filesystem>
#include <system_error>

namespace hapticd::cli {

std::string own_program(const std::string& name) {
  std::error_code unknown;
  const auto own = std::filesystem::read_symlink("/proc/self/exe", unknown);
  const auto neighbour = own.parent_path() / name;
  return !unknown && std::filesystem::exists(neighbour, unknown) ? neighbour.string() : name;
}

std::vector<char*> argument_pointers(std::vector<std::string>& words) {
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  return pointers;
}

}  // namespace hapticd::cli
