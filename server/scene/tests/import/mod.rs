//! `taut import` on awkward parts, judged by a few lines of its own.

mod awkward;
mod cases;
mod cloud_files;
mod clouds;
mod folder;
mod joined;
mod judge;
mod page;
mod pieces;
mod rubble;
mod sheets;
mod solids;
mod split;
mod write;
