#pragma once

#include <string>

namespace hapticd::server {

/// Where models are kept when no one says where: models.sqlite in $STATE_DIRECTORY (systemd), else in
/// $XDG_STATE_HOME/hapticd, else in $HOME/.local/state/hapticd. Empty where none of them is set.
std::string default_model_store();

}  // namespace hapticd::server
