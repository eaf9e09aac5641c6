// SPDX-License-Identifier: MIT
#pragma once

#define OSGTESSLOD_EXPORT __attribute__((visibility("default")))
