"""Contact laws of the reference behind one contract (`contact.law`) and their surface."""
