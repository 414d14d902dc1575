// SPDX-License-Identifier: BSD-3-Clause
/* vocabulary/vip_slam.voc as read-only data of the library; the include path is set in CMakeLists.txt. */
    .section .rodata
    .balign 16
    .globl vip_slam_shipped_vocabulary_begin
    .hidden vip_slam_shipped_vocabulary_begin
    .globl vip_slam_shipped_vocabulary_end
    .hidden vip_slam_shipped_vocabulary_end
vip_slam_shipped_vocabulary_begin:
    .incbin "vip_slam.voc"
vip_slam_shipped_vocabulary_end:
    .byte 0
    .section .note.GNU-stack,"",%progbits
