#pragma once

#include "proto/text/utf8_text.h"

namespace hapticd::server {

using text::is_utf8;
using text::printable;
using text::repaired_utf8;
using text::shortened;

}  // namespace hapticd::server
