// SPDX-License-Identifier: MIT
// Sorting networks as lists of compare-exchanges CE(i, j), i < j, so that every index is a constant
// and the elements stay in registers. 8: Batcher 1968, "Sorting networks and their applications"
// (19 steps); 16: Green 1969, in Knuth, "The Art of Computer Programming" 3, 5.3.4 (60 steps); 32:
// two of 16 and Batcher's odd-even merge (185 steps).
#define NETWORK_8 \
    CE(0, 1) CE(2, 3) CE(4, 5) CE(6, 7) CE(0, 2) CE(1, 3) CE(4, 6) CE(5, 7) CE(1, 2) CE(5, 6) \
    CE(0, 4) CE(1, 5) CE(2, 6) CE(3, 7) CE(2, 4) CE(3, 5) CE(1, 2) CE(3, 4) CE(5, 6)

#define NETWORK_16 \
    CE(0, 1) CE(2, 3) CE(4, 5) CE(6, 7) CE(8, 9) CE(10, 11) CE(12, 13) CE(14, 15) CE(0, 2) \
    CE(1, 3) CE(4, 6) CE(5, 7) CE(8, 10) CE(9, 11) CE(12, 14) CE(13, 15) CE(0, 4) CE(1, 5) \
    CE(2, 6) CE(3, 7) CE(8, 12) CE(9, 13) CE(10, 14) CE(11, 15) CE(0, 8) CE(1, 9) CE(2, 10) \
    CE(3, 11) CE(4, 12) CE(5, 13) CE(6, 14) CE(7, 15) CE(5, 10) CE(6, 9) CE(3, 12) CE(13, 14) \
    CE(4, 8) CE(7, 11) CE(1, 2) CE(1, 4) CE(7, 13) CE(2, 8) CE(11, 14) CE(2, 4) CE(5, 6) \
    CE(9, 10) CE(11, 13) CE(3, 8) CE(7, 12) CE(6, 8) CE(10, 12) CE(3, 5) CE(7, 9) CE(3, 4) \
    CE(5, 6) CE(7, 8) CE(9, 10) CE(11, 12) CE(6, 7) CE(8, 9)

#define NETWORK_16_UPPER \
    CE(16, 17) CE(18, 19) CE(20, 21) CE(22, 23) CE(24, 25) CE(26, 27) CE(28, 29) CE(30, 31) \
    CE(16, 18) CE(17, 19) CE(20, 22) CE(21, 23) CE(24, 26) CE(25, 27) CE(28, 30) CE(29, 31) \
    CE(16, 20) CE(17, 21) CE(18, 22) CE(19, 23) CE(24, 28) CE(25, 29) CE(26, 30) CE(27, 31) \
    CE(16, 24) CE(17, 25) CE(18, 26) CE(19, 27) CE(20, 28) CE(21, 29) CE(22, 30) CE(23, 31) \
    CE(21, 26) CE(22, 25) CE(19, 28) CE(29, 30) CE(20, 24) CE(23, 27) CE(17, 18) CE(17, 20) \
    CE(23, 29) CE(18, 24) CE(27, 30) CE(18, 20) CE(21, 22) CE(25, 26) CE(27, 29) CE(19, 24) \
    CE(23, 28) CE(22, 24) CE(26, 28) CE(19, 21) CE(23, 25) CE(19, 20) CE(21, 22) CE(23, 24) \
    CE(25, 26) CE(27, 28) CE(22, 23) CE(24, 25)

#define MERGE_16_16 \
    CE(0, 16) CE(1, 17) CE(2, 18) CE(3, 19) CE(4, 20) CE(5, 21) CE(6, 22) CE(7, 23) CE(8, 24) \
    CE(9, 25) CE(10, 26) CE(11, 27) CE(12, 28) CE(13, 29) CE(14, 30) CE(15, 31) CE(8, 16) \
    CE(9, 17) CE(10, 18) CE(11, 19) CE(12, 20) CE(13, 21) CE(14, 22) CE(15, 23) CE(4, 8) \
    CE(5, 9) CE(6, 10) CE(7, 11) CE(12, 16) CE(13, 17) CE(14, 18) CE(15, 19) CE(20, 24) \
    CE(21, 25) CE(22, 26) CE(23, 27) CE(2, 4) CE(3, 5) CE(6, 8) CE(7, 9) CE(10, 12) CE(11, 13) \
    CE(14, 16) CE(15, 17) CE(18, 20) CE(19, 21) CE(22, 24) CE(23, 25) CE(26, 28) CE(27, 29) \
    CE(1, 2) CE(3, 4) CE(5, 6) CE(7, 8) CE(9, 10) CE(11, 12) CE(13, 14) CE(15, 16) CE(17, 18) \
    CE(19, 20) CE(21, 22) CE(23, 24) CE(25, 26) CE(27, 28) CE(29, 30)

#define NETWORK_32 NETWORK_16 NETWORK_16_UPPER MERGE_16_16

#define EACH_7(DO, b) DO(b) DO(b + 1) DO(b + 2) DO(b + 3) DO(b + 4) DO(b + 5) DO(b + 6)
#define EACH_8(DO, b) EACH_7(DO, b) DO(b + 7)
