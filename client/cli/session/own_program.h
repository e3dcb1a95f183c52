#pragma once

#include <string>
#include <vector>

namespace hapticd::cli {

/// The path of another program of hapticd: next to this one, else as the system looks for `name`.
std::string own_program(const std::string& name);

/// Arguments as a new process takes them; they live as long as `words`.
std::vector<char*> argument_pointers(std::vector<std::string>& words);

}  // namespace hapticd::cli
