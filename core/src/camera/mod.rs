//! Camera models (pinhole, brown, fisheye) and poses as transforms.
//!
//! Camera axes are x right, y down, z forward; the centre of pixel (i, j) is (i + 0.5, j + 0.5).
