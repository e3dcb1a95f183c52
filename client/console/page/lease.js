// Exclusive control: the button at the top.

import {onLink, rpc, setLease, stream} from '/api.js';
import {setText} from '/ui.js';

const TTL_S = 10;
const RENEW_MS = 3000;

let held = null;
let timer = 0;

async function renew(notice) {
  try {
    await rpc('LeaseService/RenewLease');
  } catch (error) {
    if (error.code === 'UNAVAILABLE') return; // it may come back within the time to live
    release();
    notice(`Control was lost: ${error.message}`, 'bad');
  }
}

function release() {
  clearInterval(timer);
  setLease('');
  held = null;
}

export function leaseButton(button, notice) {
  const hold = (grant) => {
    held = grant.lease;
    setLease(grant.token);
    clearInterval(timer);
    timer = setInterval(() => renew(notice), RENEW_MS);
  };
  button.addEventListener('click', async () => {
    try {
      if (held) {
        await rpc('LeaseService/ReturnLease');
        release();
        return;
      }
      const wish = {purpose: 'console', ttl_s: TTL_S};
      try {
        hold(await rpc('LeaseService/AcquireLease', wish));
      } catch (error) {
        if (error.detail?.reason !== 'ERROR_REASON_LEASE_HELD') throw error;
        const reason = prompt(`${error.message}\n${error.remedy}\n\nTake control nevertheless? Why:`);
        if (reason) hold(await rpc('LeaseService/TakeLease', {...wish, reason}));
      }
    } catch (error) {
      notice(`${error.message}. ${error.remedy || ''}`, 'bad');
    } finally {
      tell(last);
    }
  });
  let last = null;
  const tell = (state) => {
    last = state;
    const lease = state?.lease;
    const mine = held && lease && lease.number === held.number;
    if (held && state && !mine) release();
    setText(button, mine ? 'you have control' : lease ? `controlled by ${lease.holder}` : 'take control');
    button.classList.toggle('held', Boolean(mine));
    button.title = lease ? `${lease.purpose || 'no purpose given'}; click to ${mine ? 'return' : 'take'} it`
      : 'No client has exclusive control. Click to take it; commands then need it.';
  };
  stream('LeaseService/WatchLease', {}, {message: tell, again: true});
  onLink(({state}) => { if (state !== 'live') setText(button, 'control'); });
}
