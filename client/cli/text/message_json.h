#pragma once

#include <google/protobuf/message.h>

#include <nlohmann/json.hpp>

#include "client/cli/session/session.h"

namespace hapticd::cli {

/// Turns any message of the contract into JSON, for programs to read: fields under the names and in the order
/// of the contract, numbers as numbers, enumerations as words, bit sets as lists of words. Absent groups and
/// options are left out; a number JSON cannot hold is the text "Infinity", "-Infinity" or "NaN".
Json to_json(const google::protobuf::Message& message);

/// A number, or its text if JSON has none.
Json json_number(double value);

}  // namespace hapticd::cli
