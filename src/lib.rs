//! guidedog
